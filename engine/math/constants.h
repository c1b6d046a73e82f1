#pragma once
#include <limits>

namespace penumbra::math {

inline constexpr double pi = 3.14159265358979323846;
inline constexpr double infinity = std::numeric_limits<double>::infinity(),
                        nan = std::numeric_limits<double>::quiet_NaN();
inline constexpr float float_infinity = std::numeric_limits<float>::infinity(),
                       float_nan = std::numeric_limits<float>::quiet_NaN();

}  // namespace penumbra::math
