#include "tests/server/client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <stdexcept>

namespace {

constexpr int longest_wait_ms = 30'000;

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
}

/// Bytes as characters of the same number, for JSON has no bytes.
std::string as_text(std::string_view bytes) {
  std::string text;
  for (const char c : bytes) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 0x80) {
      text += c;
    } else {
      text += static_cast<char>(0xC0 | byte >> 6);
      text += static_cast<char>(0x80 | (byte & 0x3F));
    }
  }
  return text;
}

/// One line of JSON a record. A file of an earlier run is replaced.
void write_record(const nlohmann::json& record) {
  static const char* const path = std::getenv("PENUMBRA_EXCHANGES");
  if (path == nullptr) return;
  static std::mutex mutex;
  static std::ofstream file(path);
  const std::lock_guard lock(mutex);
  file << record.dump() << std::endl;
}

/// The first request of `text`, whose head and body are then taken from it; whatever has no end is one request.
struct Asked {
  std::string line, fields;
};
Asked take_request(std::string& text) {
  const std::size_t end = text.find("\r\n\r\n");
  if (end == std::string::npos) {
    text.clear();
    return {};
  }
  const std::size_t begin = text.find_first_not_of("\r\n"), line_end = text.find("\r\n", begin);
  Asked asked{text.substr(begin, line_end - begin), lower(text.substr(line_end, end - line_end))};
  constexpr std::string_view length = "\r\ncontent-length:";
  const std::size_t field = asked.fields.find(length);
  const std::size_t body =
      field == std::string::npos ? 0 : std::strtoul(asked.fields.c_str() + field + length.size(), nullptr, 10);
  text.erase(0, body > text.size() ? text.size() : end + 4 + body);
  return asked;
}

}  // namespace

Client::Client(int port) : socket_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(static_cast<std::uint16_t>(port));
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const int yes = 1;
  ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
  if (::connect(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    throw std::runtime_error("cannot connect");
}

Client::~Client() { close(); }

void Client::finish_sending() { ::shutdown(socket_, SHUT_WR); }

void Client::close() {
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
}

bool Client::send(std::string_view bytes) {
  // Enough to tell what was asked.
  unanswered_.append(bytes.substr(0, 1u << 20));
  while (!bytes.empty()) {
    const ssize_t count = ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (count <= 0) return false;
    bytes.remove_prefix(static_cast<std::size_t>(count));
  }
  return true;
}

bool Client::receive() {
  pollfd watched{socket_, POLLIN, 0};
  if (::poll(&watched, 1, longest_wait_ms) <= 0) throw std::runtime_error("the server says nothing");
  char buffer[65536];
  const ssize_t count = ::recv(socket_, buffer, sizeof buffer, 0);
  if (count <= 0) return false;
  received_.append(buffer, static_cast<std::size_t>(count));
  return true;
}

std::optional<std::string> Client::take_until(std::string_view mark) {
  std::size_t end = 0;
  while ((end = received_.find(mark)) == std::string::npos) {
    if (!receive()) return std::nullopt;
  }
  std::string text = received_.substr(0, end);
  received_.erase(0, end + mark.size());
  return text;
}

std::optional<Reply> Client::read_head() {
  const std::optional<std::string> text = take_until("\r\n\r\n");
  if (!text || text->size() < 12) return std::nullopt;
  Reply reply;
  reply.status = std::stoi(text->substr(9, 3));
  std::size_t begin = text->find("\r\n");
  reply.reason = text->substr(12, begin - 12);
  while (begin != std::string::npos) {
    begin += 2;
    const std::size_t end = text->find("\r\n", begin);
    const std::string line = text->substr(begin, end == std::string::npos ? end : end - begin);
    const std::size_t colon = line.find(':');
    reply.headers[lower(line.substr(0, colon))] = line.substr(line.find_first_not_of(' ', colon + 1));
    begin = end;
  }
  return reply;
}

void Client::record(const Reply& reply, bool has_body) {
  if (reply.status == 100) return;
  const Asked asked = take_request(unanswered_);
  asked_ = asked.line;
  nlohmann::json body = has_body ? nlohmann::json(as_text(reply.body)) : nlohmann::json();
  write_record({{"request", as_text(asked.line)},
                {"fields", as_text(asked.fields)},
                {"status", reply.status},
                {"headers", reply.headers},
                {"body", std::move(body)}});
}

std::optional<Reply> Client::head() {
  const std::optional<Reply> reply = read_head();
  if (reply) record(*reply, false);
  return reply;
}

std::optional<Reply> Client::reply(bool has_body) {
  std::optional<Reply> reply = read_head();
  while (reply && reply->status < 200) reply = read_head();
  if (!reply) return reply;
  const auto length = reply->headers.find("content-length");
  if (has_body && length != reply->headers.end()) {
    const std::size_t size = std::stoul(length->second);
    while (received_.size() < size) {
      if (!receive()) return std::nullopt;
    }
    reply->body = received_.substr(0, size);
    received_.erase(0, size);
  }
  record(*reply, has_body);
  return reply;
}

std::optional<Reply> Client::request(std::string_view method, std::string_view path, std::string_view body,
                                     std::string_view headers) {
  std::string text = std::string(method) + " " + std::string(path) + " HTTP/1.1\r\nHost: 127.0.0.1\r\n";
  text.append(headers);
  if (!body.empty() || method == "POST") text += "Content-Length: " + std::to_string(body.size()) + "\r\n";
  send(text.append("\r\n").append(body));
  return reply(method != "HEAD");
}

std::optional<Event> Client::event() {
  while (true) {
    const std::optional<std::string> text = take_until("\n\n");
    if (!text) return std::nullopt;
    Event event;
    std::size_t begin = 0;
    while (begin < text->size()) {
      const std::size_t end = std::min(text->find('\n', begin), text->size());
      const std::string line = text->substr(begin, end - begin);
      if (line.starts_with("id: ")) event.id = line.substr(4);
      if (line.starts_with("event: ")) event.name = line.substr(7);
      if (line.starts_with("data: ")) event.data = line.substr(6);
      begin = end + 1;
    }
    if (event.name.empty()) continue;
    write_record({{"request", as_text(asked_)}, {"event", event.name}, {"data", as_text(event.data)}});
    return event;
  }
}

bool Client::is_closed_by_server() {
  if (!received_.empty()) return false;
  return !receive();
}

Reply call(int port, std::string_view method, std::string_view path, std::string_view body, std::string_view headers) {
  Client client(port);
  const std::optional<Reply> reply = client.request(method, path, body, headers);
  if (!reply) throw std::runtime_error("no reply");
  return *reply;
}

Reply post(int port, std::string_view path, std::string_view json, std::string_view headers) {
  return call(port, "POST", path, json, "Content-Type: application/json\r\n" + std::string(headers));
}
