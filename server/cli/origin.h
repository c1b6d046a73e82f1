#pragma once
#include <optional>
#include <string>
#include <string_view>

namespace penumbra::cli {

/// The origin (RFC 6454) of the page `text` is the address of, as browsers write it in the field Origin: scheme and
/// host in lower case, no path, no port that the scheme implies. Nothing when it is no such address.
std::optional<std::string> origin_of(std::string_view text);

}  // namespace penumbra::cli
