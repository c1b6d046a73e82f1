#include "tests/server/client.h"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>

namespace {

constexpr int longest_wait_ms = 30'000;

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return std::tolower(c); });
  return text;
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

void Client::close() {
  if (socket_ >= 0) ::close(socket_);
  socket_ = -1;
}

bool Client::send(std::string_view bytes) {
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

std::optional<Reply> Client::head() {
  const std::optional<std::string> text = take_until("\r\n\r\n");
  if (!text || text->size() < 12) return std::nullopt;
  Reply reply;
  reply.status = std::stoi(text->substr(9, 3));
  std::size_t begin = text->find("\r\n");
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

std::optional<Reply> Client::reply(bool has_body) {
  std::optional<Reply> reply = head();
  if (!reply || !has_body) return reply;
  const auto length = reply->headers.find("content-length");
  if (length == reply->headers.end()) return reply;
  const std::size_t size = std::stoul(length->second);
  while (received_.size() < size) {
    if (!receive()) return std::nullopt;
  }
  reply->body = received_.substr(0, size);
  received_.erase(0, size);
  return reply;
}

std::optional<Reply> Client::request(std::string_view method, std::string_view path, std::string_view body,
                                     std::string_view headers) {
  std::string text = std::string(method) + " " + std::string(path) + " HTTP/1.1\r\nHost: test\r\n";
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
    if (!event.name.empty()) return event;
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
