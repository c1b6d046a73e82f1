#pragma once
#include <string>
#include <string_view>

namespace penumbra::api {

/// One step of an RFC 6901 pointer: a slash and `token`, in which ~ is ~0 and / is ~1.
inline std::string pointer_step(std::string_view token) {
  std::string step(1, '/');
  for (const char c : token) {
    if (c == '~') {
      step += "~0";
    } else if (c == '/') {
      step += "~1";
    } else {
      step += c;
    }
  }
  return step;
}

}  // namespace penumbra::api
