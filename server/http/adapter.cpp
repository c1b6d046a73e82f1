#include "server/http/adapter.h"

#include <httplib.h>

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
    return producer(send);
  });
}

void put_body(const std::string& text, const std::string& media_type, httplib::Response& to) {
  if (!media_type.empty()) to.set_content(text, media_type);
}

void put_body(std::string_view bytes, const std::string& media_type, httplib::Response& to) {
  to.set_content(bytes.data(), bytes.size(), media_type);
}

/// The reason phrases (RFC 9110, 15) of answers that are given without the library.
std::string_view reason_of(int status) {
  switch (status) {
    case 400:
      return "Bad Request";
    case 408:
      return "Request Timeout";
    case 411:
      return "Length Required";
    case 413:
      return "Content Too Large";
    case 414:
      return "URI Too Long";
    case 415:
      return "Unsupported Media Type";
    case 431:
      return "Request Header Fields Too Large";
    case 501:
      return "Not Implemented";
    case 503:
      return "Service Unavailable";
    case 505:
      return "HTTP Version Not Supported";
    default:
      return "";
  }
}

}  // namespace

Request request_of(const httplib::Request& from, std::string id) {
  Request request;
  request.method = from.method == "HEAD" ? "GET" : from.method;
  request.path = from.path;
  request.id = std::move(id);
  request.query.assign(from.params.begin(), from.params.end());
  request.body = from.body;
  return request;
}

void put(const Response& from, httplib::Response& to) {
  to.status = from.status;
  for (const auto& [name, value] : from.headers) to.set_header(name, value);
  std::visit([&](const auto& body) { put_body(body, from.media_type, to); }, from.body);
}

std::string closing_text(const Response& response, const Fields& more) {
  const std::string& body = std::get<std::string>(response.body);
  std::string text = "HTTP/1.1 " + std::to_string(response.status) + " ";
  text.append(reason_of(response.status)).append("\r\nConnection: close\r\nDate: ").append(http_date()).append("\r\n");
  for (const Fields& fields : {response.headers, more}) {
    for (const auto& [name, value] : fields) text.append(name).append(": ").append(value).append("\r\n");
  }
  return text + "Content-Type: " + response.media_type + "\r\nContent-Length: " + std::to_string(body.size()) +
         "\r\n\r\n" + body;
}

}  // namespace penumbra::http
