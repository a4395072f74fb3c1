#include <array>
#include <fcntl.h>
#include <functional>
#include <gmock/gmock.h>
#include <optional>
#include <random>
#include <sys/socket.h>
#include <thread>

#include "drivers/tcp/emulator.hpp"
#include "drivers/tcp/linux_tcp.hpp"

namespace probebox::tcp {
namespace {

using ::testing::HasSubstr;
using Bytes = std::vector<std::byte>;
using Pipe = std::unique_ptr<io::BytePipe>;
constexpr std::chrono::milliseconds kPatience{20};
constexpr std::chrono::milliseconds kConnectPatience{5000};

Bytes randomBytes(std::size_t count) {
  std::mt19937 random{3};
  Bytes all(count);
  for (auto& byte : all) byte = static_cast<std::byte>(random());
  return all;
}

// Sends all of it from one end and collects what comes out at the other, until nothing more comes. `step` moves what is
// between them.
Bytes carry(io::BytePipe& from, io::BytePipe& to, std::span<const std::byte> all, const std::function<void()>& step) {
  Bytes received;
  std::array<std::byte, 8192> buffer{};
  for (int idle = 0; idle < 50;) {
    const auto sent = from.write(all);
    all = all.subspan(sent.bytes);
    step();
    const auto got = to.read(buffer);
    received.insert(received.end(), buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(got.bytes));
    idle = sent.bytes + got.bytes > 0 ? 0 : idle + 1;
  }
  return received;
}

bool eventually(const std::function<bool()>& condition) {
  for (int i = 0; i < 2000; ++i) {
    if (condition()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds{5});
  }
  return false;
}

class TcpConnection : public ::testing::Test {
 protected:
  void SetUp() override {
    auto listener = Listener::open({"127.0.0.1", 0});
    ASSERT_TRUE(listener.ok()) << listener.error().what;
    listener_.emplace(std::move(listener).value());
  }

  // Host end and box end of one connection.
  std::pair<Pipe, Pipe> connect() {
    auto host = connectTcp(listener_->address(), kConnectPatience);
    EXPECT_TRUE(host.ok()) << (host.ok() ? "" : host.error().what);
    Pipe box;
    EXPECT_TRUE(eventually([&] { return (box = listener_->accept()) != nullptr; }));
    return {std::move(host).value(), std::move(box)};
  }

  std::optional<Listener> listener_;
};

TEST_F(TcpConnection, CarriesBytesBothWaysAndNamesItsPeer) {
  const auto [host, box] = connect();
  const auto all = randomBytes(300'000);
  const auto wait = [] { std::this_thread::sleep_for(std::chrono::milliseconds{1}); };
  EXPECT_EQ(carry(*host, *box, all, wait), all);
  EXPECT_EQ(carry(*box, *host, all, wait), all);
  EXPECT_THAT(std::string{box->name()}, ::testing::StartsWith("tcp:127.0.0.1:"));
}

TEST_F(TcpConnection, IsClosedWhenThePeerLeavesInAnOrderlyWayOrNot) {
  for (const bool reset : {false, true}) {
    auto [host, box] = connect();
    // Unread bytes turn the end of a connection into a reset.
    if (reset) {
      box->write(randomBytes(100));
      EXPECT_TRUE(eventually([&] {
        std::byte peek{};
        return recv(host->descriptor(), &peek, 1, MSG_PEEK | MSG_DONTWAIT) == 1;
      }));
    }
    host.reset();
    std::array<std::byte, 16> buffer{};
    EXPECT_TRUE(eventually([&] { return box->read(buffer).state == io::PipeState::closed; }));
    EXPECT_EQ(box->read(buffer).bytes, 0U);
    // Neither does writing to nobody end the process by a signal.
    const auto block = randomBytes(10'000);
    EXPECT_TRUE(eventually([&] { return box->write(block).state == io::PipeState::closed; }));
  }
}

TEST_F(TcpConnection, GivesNothingWhenNobodyWaits) {
  EXPECT_EQ(listener_->accept(), nullptr);
}

TEST_F(TcpConnection, IsRefusedWithARemedy) {
  EXPECT_THAT(Listener::open(listener_->address()).error().what, HasSubstr("another process"));
  EXPECT_THAT(Listener::open({"203.0.113.1", 0}).error().what, HasSubstr("that address"));
  const auto gone = listener_->address();
  listener_.reset();
  EXPECT_THAT(connectTcp(gone, kConnectPatience).error().what, HasSubstr("nothing listens"));
}

TEST_F(TcpConnection, GetsItsPortBackAtOnceAfterARestart) {
  const auto address = listener_->address();
  auto [host, box] = connect();
  box.reset();  // the side that closes first keeps the port in TIME_WAIT
  listener_.reset();
  host.reset();
  const auto again = Listener::open(address);
  EXPECT_TRUE(again.ok()) << again.error().what;
}

TEST_F(TcpConnection, ComesThroughAListenerThatAnotherOpened) {
  auto adopted = Listener::adopt(io::Descriptor{dup(listener_->descriptor())}, "box.socket");
  ASSERT_TRUE(adopted) << adopted.error().what;
  EXPECT_EQ(describe(adopted->address()), describe(listener_->address()));
  // As the service manager passes it on: one that waits for ever.
  ASSERT_EQ(fcntl(adopted->descriptor(), F_SETFL, 0), 0);
  adopted = Listener::adopt(io::Descriptor{dup(adopted->descriptor())}, "box.socket");
  ASSERT_TRUE(adopted);
  EXPECT_EQ(adopted->accept(), nullptr);
  const auto host = connectTcp(adopted->address(), kConnectPatience);
  ASSERT_TRUE(host);
  EXPECT_TRUE(eventually([&] { return adopted->accept() != nullptr; }));
}

TEST(TcpListener, IsNotMadeOfWhatIsNone) {
  std::array<int, 2> pipe_ends{};
  ASSERT_EQ(pipe(pipe_ends.data()), 0);
  close(pipe_ends[1]);
  const io::Descriptor local{socket(AF_UNIX, SOCK_STREAM, 0)};
  ASSERT_EQ(listen(local.get(), 1), -1);
  const auto datagrams = socket(AF_INET, SOCK_DGRAM, 0);
  const auto not_listening = socket(AF_INET, SOCK_STREAM, 0);
  for (const int other : {pipe_ends[0], dup(local.get()), datagrams, not_listening, -1}) {
    const auto adopted = Listener::adopt(io::Descriptor{other}, "box.socket");
    ASSERT_FALSE(adopted);
    EXPECT_THAT(adopted.error().what, ::testing::AllOf(HasSubstr("'box.socket'"), HasSubstr("ListenStream=")));
  }
}

TEST(TcpListener, CoversTheAddressesThatItIsReachedBy) {
  const auto covered = [](const char* listener, const char* connection) {
    return covers(*parseAddress(listener), *parseAddress(connection));
  };
  EXPECT_TRUE(covered("127.0.0.1:7627", ":7627"));
  for (const auto* const here : {":1", "127.0.0.1:1", "127.1.2.3:1", "localhost:1", "[::1]:1"})
    EXPECT_TRUE(isLoopback(*parseAddress(here))) << here;
  for (const auto* const anywhere : {"0.0.0.0:1", "[::]:1", "192.168.0.1:1", "127.example.com:1", "box.local:1"})
    EXPECT_FALSE(isLoopback(*parseAddress(anywhere))) << anywhere;
  EXPECT_TRUE(covered("0.0.0.0:7627", "127.0.0.1:7627"));
  EXPECT_TRUE(covered("[::]:7627", "10.0.0.7:7627"));
  EXPECT_FALSE(covered("127.0.0.1:7627", "127.0.0.1:7628"));
  EXPECT_FALSE(covered("127.0.0.1:7627", "10.0.0.7:7627"));
  EXPECT_FALSE(covered("127.0.0.1:7627", "0.0.0.0:7627"));
}

class Wire : public TcpConnection {
 protected:
  void SetUp() override {
    TcpConnection::SetUp();
    auto wire = EmulatedWire::open({"127.0.0.1", 0}, listener_->address());
    ASSERT_TRUE(wire.ok()) << wire.error().what;
    wire_.emplace(std::move(wire).value());
  }

  std::pair<Pipe, Pipe> connectByWire() {
    auto host = connectTcp(wire_->address(), kConnectPatience);
    EXPECT_TRUE(host.ok());
    Pipe box;
    EXPECT_TRUE(eventually([&] {
      wire_->pump(kPatience);
      return (box = listener_->accept()) != nullptr;
    }));
    return {std::move(host).value(), std::move(box)};
  }
  std::function<void()> pump() {
    return [this] { wire_->pump(kPatience); };
  }

  std::optional<EmulatedWire> wire_;
};

TEST_F(Wire, CarriesEverythingUnchangedWhenItIsGood) {
  const auto [host, box] = connectByWire();
  const auto all = randomBytes(200'000);
  EXPECT_EQ(carry(*box, *host, all, pump()), all);
  EXPECT_EQ(wire_->towardsHost().carried, all.size());
  EXPECT_EQ(wire_->towardsHost().corrupted + wire_->towardsHost().dropped, 0U);
}

TEST_F(Wire, DoesTheSameDamageForTheSameSeed) {
  const auto all = randomBytes(100'000);
  std::array<Bytes, 2> received;
  for (auto& bytes : received) {
    const auto [host, box] = connectByWire();
    wire_->disturb({42, 1e-3, 5e-4}, {});
    bytes = carry(*box, *host, all, pump());
  }
  EXPECT_EQ(received[0], received[1]);
  EXPECT_EQ(received[0].size(), all.size() - wire_->towardsHost().dropped / 2);
  // Four standard deviations around 200 and 100 faults in two runs.
  EXPECT_NEAR(static_cast<double>(wire_->towardsHost().corrupted), 200, 57 + 57);
  EXPECT_NEAR(static_cast<double>(wire_->towardsHost().dropped), 100, 40 + 40);
}

TEST_F(Wire, HoldsBytesDuringAStallAndEndsBothSidesWhenItIsCut) {
  const auto [host, box] = connectByWire();
  wire_->stall(true);
  host->write(randomBytes(10));
  EXPECT_EQ(wire_->pump(kPatience), 0U);
  wire_->stall(false);
  EXPECT_TRUE(eventually([&] { return wire_->pump(kPatience) == 10; }));

  wire_->cut();
  std::array<std::byte, 16> buffer{};
  for (const auto* const end : {&host, &box}) {
    EXPECT_TRUE(eventually([&] { return (*end)->read(buffer).state == io::PipeState::closed; }));
  }
  EXPECT_NE(connectByWire().first, nullptr) << "a new host is carried again";
}

TEST(TcpAddress, IsHostAndPort) {
  EXPECT_EQ(describe(*parseAddress("10.0.0.7:80")), "10.0.0.7:80");
  EXPECT_EQ(describe(*parseAddress(":7627")), "127.0.0.1:7627");
  EXPECT_EQ(describe(*parseAddress("[::1]:7627")), "[::1]:7627");
  for (const auto* const bad : {"", "7627", "host", "host:", "host:70000", "host:1x", "::1:80", "a b:1"}) {
    ASSERT_FALSE(parseAddress(bad).ok()) << bad;
    EXPECT_THAT(parseAddress(bad).error().what, HasSubstr("write HOST:PORT"));
  }
}

}  // namespace
}  // namespace probebox::tcp
