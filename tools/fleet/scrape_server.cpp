#include "tools/fleet/scrape_server.hpp"

#include <algorithm>
#include <array>
#include <span>
#include <string_view>

namespace probebox::fleet {
namespace {

std::string answerWith(const char* status, const char* type, std::string_view body, bool with_body = true) {
  return std::string{"HTTP/1.1 "} + status + "\r\nContent-Type: " + type +
         "\r\nContent-Length: " + std::to_string(body.size()) + "\r\nConnection: close\r\n\r\n" +
         (with_body ? std::string{body} : std::string{});
}

std::string answerTo(std::string_view head, const std::function<std::string()>& metrics) {
  constexpr auto kPlain = "text/plain; charset=utf-8";
  const auto line = head.substr(0, head.find("\r\n"));
  const auto method = line.substr(0, line.find(' '));
  if (method != "GET" && method != "HEAD") return answerWith("405 Method Not Allowed", kPlain, "GET /metrics\n");
  const auto rest = line.substr(std::min(method.size() + 1, line.size()));
  const auto path = rest.substr(0, rest.find_first_of(" ?"));
  if (path != "/metrics") return answerWith("404 Not Found", kPlain, "GET /metrics\n", method == "GET");
  return answerWith("200 OK", "text/plain; version=0.0.4; charset=utf-8", metrics(), method == "GET");
}

}  // namespace

std::vector<int> ScrapeServer::descriptors() const {
  std::vector<int> all{listener_.descriptor()};
  for (const auto& connection : connections_) all.push_back(connection.pipe->descriptor());
  return all;
}

void ScrapeServer::round(MonoTime now, const std::function<std::string()>& metrics) {
  // No more than these in one round, so that others have their turn.
  for (std::size_t taken = 0; taken < kMostConnections; ++taken) {
    auto pipe = listener_.accept();
    if (!pipe) break;
    if (connections_.size() == kMostConnections) connections_.pop_front();
    connections_.push_back({std::move(pipe), now, {}, {}});
  }
  for (auto& connection : connections_) serve(connection, metrics);
  std::erase_if(connections_, [&](const Connection& each) { return each.ended || now - each.since > kPatience; });
}

void ScrapeServer::serve(Connection& connection, const std::function<std::string()>& metrics) {
  if (connection.answer.empty()) {
    std::array<char, 2048> bytes{};
    while (connection.head.size() < kMostHead_bytes) {
      const auto got = connection.pipe->read(std::as_writable_bytes(std::span{bytes}));
      connection.ended = got.state == io::PipeState::closed;
      if (got.bytes == 0) break;
      connection.head.append(bytes.data(), got.bytes);
    }
    if (connection.head.find("\r\n\r\n") != std::string::npos) {
      connection.answer = answerTo(connection.head, metrics);
      connection.ended = false;
    } else if (connection.head.size() >= kMostHead_bytes) {
      connection.answer = answerWith("431 Request Header Fields Too Large", "text/plain", "");
    }
  }
  while (!connection.answer.empty()) {
    const auto put = connection.pipe->write(std::as_bytes(std::span{connection.answer}));
    connection.answer.erase(0, put.bytes);
    connection.ended = connection.answer.empty() || put.state == io::PipeState::closed;
    if (put.bytes == 0) break;
  }
}

}  // namespace probebox::fleet
