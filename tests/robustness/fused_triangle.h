#pragma once
#include <array>

/// The engine's triangle test compiled so that multiplications and additions are fused wherever the compiler likes.
namespace fused {

using Point = std::array<double, 3>;
bool meets(const std::array<Point, 3>& triangle, const Point& origin, const Point& direction);
/// Whether this processor can run it.
bool is_available();

}  // namespace fused
