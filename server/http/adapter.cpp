#include "server/http/adapter.h"

#include <httplib.h>

#include <algorithm>
#include <vector>

#include "server/http/problems.h"

namespace penumbra::http {

namespace {

void put_body(const std::shared_ptr<const std::string>& bytes, const std::string& media_type, httplib::Response& to) {
  if (bytes->empty()) return;
  to.set_content_provider(bytes->size(), media_type,
                          [bytes](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
                            return sink.write(bytes->data() + offset, length);
                          });
}

void put_body(const Producer& producer, const std::string& media_type, httplib::Response& to) {
  to.set_header("Connection", "close");
  to.set_content_provider(media_type, [producer](std::size_t, httplib::DataSink& sink) {
    const Send send = [&](std::string_view bytes) { return sink.write(bytes.data(), bytes.size()); };
    // False ends the connection, and with it the body: it has no length.
    return producer(send, sink.is_writable);
  });
}

void put_body(const std::string& text, const std::string& media_type, httplib::Response& to) {
  if (!media_type.empty()) to.set_content(text, media_type);
}

void put_body(std::string_view bytes, const std::string& media_type, httplib::Response& to) {
  to.set_content(bytes.data(), bytes.size(), media_type);
}

/// Between semicolons, trimmed.
std::vector<std::string_view> parts_of(std::string_view field) {
  std::vector<std::string_view> parts;
  std::size_t begin = 0, end = 0;
  do {
    end = std::min(field.find(';', begin), field.size());
    parts.push_back(trimmed(field.substr(begin, end - begin)));
    begin = end + 1;
  } while (end < field.size());
  return parts;
}

}  // namespace

Request request_of(const httplib::Request& from, std::string id) {
  Request request;
  request.method = from.method == "HEAD" ? "GET" : from.method;
  request.path = from.path;
  request.id = std::move(id);
  request.query.assign(from.params.begin(), from.params.end());
  for (const auto& [name, value] : from.headers) request.headers.emplace_back(lower_case(name), value);
  request.body = from.body;
  request.is_client_there = [&from] { return from.progress(0, 0); };
  return request;
}

void put(const Response& from, httplib::Response& to) {
  to.status = from.status;
  for (const auto& [name, value] : from.headers) to.set_header(name, value);
  std::visit([&](const auto& body) { put_body(body, from.media_type, to); }, from.body);
}

std::string closing_text(const Response& response, const Fields& more) {
  const std::string& body = std::get<std::string>(response.body);
  std::string text =
      "HTTP/1.1 " + std::to_string(response.status) + " \r\nConnection: close\r\nDate: " + http_date() + "\r\n";
  for (const Fields& fields : {response.headers, more}) {
    for (const auto& [name, value] : fields) text.append(name).append(": ").append(value).append("\r\n");
  }
  return text + "Content-Type: " + response.media_type + "\r\nContent-Length: " + std::to_string(body.size()) +
         "\r\n\r\n" + body;
}

std::optional<api::Problem> refusal_of_body(const httplib::Request& request) {
  if (!request.has_header("Content-Length")) return length_required();
  const std::string type = lower_case(request.get_header_value("Content-Type"));
  const std::vector<std::string_view> parts = parts_of(type);
  const bool is_json = parts.front() == "application/json";
  const bool is_utf8 = std::ranges::all_of(parts, [](std::string_view part) {
    return !part.starts_with("charset=") || part == "charset=utf-8" || part == "charset=\"utf-8\"";
  });
  if (is_json && is_utf8) return std::nullopt;
  return unsupported_media_type("send the header Content-Type: application/json" +
                                std::string(is_json ? " without a charset other than utf-8" : ""));
}

}  // namespace penumbra::http
