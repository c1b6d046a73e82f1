#pragma once
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "api/problem.h"
#include "server/http/message.h"

namespace penumbra::http {

/// What gzip (RFC 1952) has made smaller; nothing when `may_take`, asked for the size of the result as it grows, says
/// no. Or why there is none: the bytes are damaged, or there are more than `max_bytes`.
std::variant<std::optional<std::string>, api::Problem> inflate(std::string_view gzip, std::size_t max_bytes,
                                                               const std::function<bool(std::size_t bytes)>& may_take);

/// Compresses the answer where that pays and the client takes it: text of a kilobyte and more.
void compress_for(const FieldValues& fields, Response& response);

/// The strong ETag of what `tag` names, compressed: other bytes, another tag (RFC 9110, 8.8.3.3).
std::string gzip_tag(std::string_view tag);

}  // namespace penumbra::http
