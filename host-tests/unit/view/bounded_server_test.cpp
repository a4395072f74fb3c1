#include "tools/probebox/view/bounded_server.hpp"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <string>
#include <thread>

namespace probebox::view {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class Bounded : public testing::Test {
 protected:
  Bounded() {
    server_.set_read_timeout(1);
    server_.Get("/", [](const auto&, auto& response) { response.set_content("here", "text/plain"); });
    port_ = server_.bind_to_any_port("127.0.0.1");
    serving_ = std::thread{[this] { server_.listen_after_bind(); }};
    while (!server_.is_running()) std::this_thread::yield();
  }
  ~Bounded() override {
    server_.stop();
    serving_.join();
  }

  int connected() const {
    const int socket = ::socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(static_cast<std::uint16_t>(port_));
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket, reinterpret_cast<const sockaddr*>(&to), sizeof to), 0);
    return socket;
  }
  static bool send(int socket, const std::string& text) {
    return ::send(socket, text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
  }
  // Until the server closes.
  static std::string all(int socket) {
    std::string text;
    char part[4096];
    for (ssize_t got = 0; (got = ::recv(socket, part, sizeof part, 0)) > 0;)
      text.append(part, static_cast<std::size_t>(got));
    ::close(socket);
    return text;
  }

  BoundedServer server_;
  int port_{};
  std::thread serving_;
};

TEST_F(Bounded, AnswersARequest) {
  const int socket = connected();
  ASSERT_TRUE(send(socket, "GET / HTTP/1.1\r\nHost: a\r\nConnection: close\r\n\r\n"));
  const auto answer = all(socket);
  EXPECT_THAT(answer, StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(answer, HasSubstr("here"));
}

#ifndef CPPHTTPLIB_HEADER_MAX_COUNT
TEST_F(Bounded, RefusesAHeadWithoutEnd) {
  const int socket = connected();
  ASSERT_TRUE(send(socket, "GET / HTTP/1.1\r\n"));
  for (std::size_t sent = 0; sent <= kMostHead_bytes; sent += 1000)
    if (!send(socket, "A: " + std::string(995, 'a') + "\r\n")) break;
  EXPECT_THAT(all(socket), StartsWith("HTTP/1.1 431"));
}

TEST_F(Bounded, EndsAConnectionWhoseHeadTrickles) {
  const int socket = connected();
  ASSERT_TRUE(send(socket, "GET / HTTP/1.1\r\n"));
  // A server that waits for each byte anew would never end it.
  int bytes = 0;
  while (bytes < 1000 && send(socket, "a")) {
    std::this_thread::sleep_for(std::chrono::milliseconds{50});
    ++bytes;
  }
  EXPECT_LT(bytes, 1000);
  ::close(socket);
}
#endif

}  // namespace
}  // namespace probebox::view
