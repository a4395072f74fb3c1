#include "firmware/app/host/connection_acceptor.hpp"

#include <arpa/inet.h>
#include <atomic>
#include <chrono>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <thread>
#include <vector>

#include "drivers/io/descriptor.hpp"
#include "protocol/frame/frame.hpp"
#include "protocol/messages/handshake.hpp"

// Who gets a place before HELLO. The time that connections have stands still here: only others can take a place.
namespace probebox::app {
namespace {

using namespace std::chrono_literals;

class Acceptor : public testing::Test {
 protected:
  // secure: as of ConnectionAcceptor::listen().
  tcp::Address open(ConnectionAcceptor::Secure secure = {}) {
    auto listener = tcp::Listener::open({.host = "127.0.0.1", .port = 0});
    const auto address = listener->address();
    acceptor_.listen(std::move(*listener), std::move(secure));
    thread_ = std::jthread{[this] {
      acceptor_.open();
      const auto watch = loop_.every(1ms, [this] {
        acceptor_.advance(monoTime(1));
        gave_way_ = acceptor_.counters().silent;
        ++rounds_;
        if (over_) loop_.quit();
      });
      loop_.run();
      acceptor_.close();
    }};
    return address;
  }
  void TearDown() override { over_ = true; }
  static io::Descriptor connectedFrom(const char* source, const tcp::Address& to) {
    io::Descriptor socket{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)};
    sockaddr_in at{};
    at.sin_family = AF_INET;
    inet_pton(AF_INET, source, &at.sin_addr);
    EXPECT_EQ(bind(socket.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
    inet_pton(AF_INET, to.host.c_str(), &at.sin_addr);
    at.sin_port = htons(to.port);
    EXPECT_EQ(connect(socket.get(), reinterpret_cast<const sockaddr*>(&at), sizeof at), 0);
    return socket;
  }
  static bool eventually(const std::function<bool()>& is_so) {
    for (int k = 0; k < 4000; ++k) {
      if (is_so()) return true;
      std::this_thread::sleep_for(5ms);
    }
    return false;
  }
  static void sayHello(const io::Descriptor& socket) {
    const auto payload = messages::encoded(messages::Hello::current());
    std::vector<std::byte> scratch(frame::bareSize(payload.size())), coded(frame::delimitedMaxSize(payload.size()));
    coded.resize(frame::encodeDelimited({.type = static_cast<std::uint8_t>(messages::MessageType::hello)}, payload,
                                        scratch, coded));
    EXPECT_EQ(send(socket.get(), coded.data(), coded.size(), MSG_NOSIGNAL), static_cast<ssize_t>(coded.size()));
  }

  EventLoop loop_;
  std::atomic<int> entered_{};
  std::atomic<std::uint64_t> gave_way_{};
  std::atomic<int> rounds_{};
  std::atomic<bool> over_{};
  ConnectionAcceptor acceptor_{loop_,
                               {.why_full = [](std::size_t) { return std::optional<std::string>{}; },
                                .enter = [this](const ConnectionAcceptor::GreetedConnection&) { ++entered_; }}};
  std::jthread thread_;
};

TEST_F(Acceptor, ACrowdOfOneComputerCrowdsItselfOutAndNobodyElse) {
  constexpr std::uint64_t kCrowd = 100;
  const auto address = open();
  const auto slow = connectedFrom("127.0.0.1", address);
  std::vector<io::Descriptor> crowd;
  while (crowd.size() < kCrowd) crowd.push_back(connectedFrom("127.0.0.2", address));
  ASSERT_TRUE(eventually([&] { return gave_way_ == kCrowd + 1 - ConnectionAcceptor::kMostWaiting; }));
  sayHello(slow);
  EXPECT_TRUE(eventually([&] { return entered_ == 1; }));
  sayHello(crowd.back());
  EXPECT_TRUE(eventually([&] { return entered_ == 2; })) << "nor all of the crowd";
}

TEST_F(Acceptor, TakesFewConnectionsATurnWhereEachCostsASignature) {
  std::atomic<int> taken{}, last_round{}, in_round{}, most{};
  const auto address = open([&](std::unique_ptr<io::BytePipe> pipe) {
    in_round = last_round.exchange(rounds_) == rounds_ ? in_round + 1 : 1;
    most = std::max(most.load(), in_round.load());
    ++taken;
    return pipe;
  });
  std::vector<io::Descriptor> all;
  while (all.size() < 30) all.push_back(connectedFrom("127.0.0.1", address));
  EXPECT_TRUE(eventually([&] { return taken == 30; }));
  EXPECT_LE(most, ConnectionAcceptor::kMostSecured);
  sayHello(all.back());
  EXPECT_TRUE(eventually([&] { return entered_ == 1; }));
}

TEST_F(Acceptor, LetsNobodyInWhereADoorHasNoKeys) {
  const auto address = open([](std::unique_ptr<io::BytePipe>) { return nullptr; });
  const auto host = connectedFrom("127.0.0.1", address);
  std::array<char, 8> bytes{};
  EXPECT_LE(recv(host.get(), bytes.data(), bytes.size(), 0), 0) << "it is closed at once";
}

}  // namespace
}  // namespace probebox::app
