// Strangers at the door: whoever belongs there comes in all the same, and nothing is left of them.
#include <algorithm>
#include <array>
#include <chrono>
#include <filesystem>
#include <gmock/gmock.h>
#include <random>
#include <thread>

#include "drivers/tls/connection.hpp"
#include "fixture.hpp"
#include "host-tests/keys/raw_client.hpp"

namespace probebox {
namespace {

using namespace std::chrono_literals;
using support::RawClient;
using testing::HasSubstr;
using Pipe = std::unique_ptr<io::BytePipe>;

std::vector<std::byte> bytesOf(std::string_view text) {
  const auto bytes = std::as_bytes(std::span{text});
  return {bytes.begin(), bytes.end()};
}

class Attacks : public Door {
 protected:
  std::size_t filesOfDaemon() const {
    const std::filesystem::directory_iterator files{"/proc/" + std::to_string(daemon->pid()) + "/fd"};
    return static_cast<std::size_t>(std::distance(begin(files), end(files)));
  }
  Pipe connected(const tcp::Address& to) const {
    auto pipe = tcp::connectTcp(to, 20s);
    EXPECT_TRUE(pipe);
    return pipe ? std::move(*pipe) : nullptr;
  }
  // True when the box ends the connection.
  static bool isEnded(io::BytePipe& pipe) {
    std::array<std::byte, 512> bytes{};
    for (int k = 0; k < 2000; ++k) {
      if (pipe.read(bytes).state == io::PipeState::closed) return true;
      std::this_thread::sleep_for(5ms);
    }
    return false;
  }
  // A stranger with OpenSSL, until the box lets go.
  bool isRefused(const std::function<void(SSL_CTX*)>& prepare) const {
    const auto carrier = connected(door);
    RawClient client{*carrier, prepare};
    for (int k = 0; k < 2000; ++k) {
      client.step();
      const int state = SSL_get_shutdown(client.get());
      const auto error = ERR_peek_error();
      if (error != 0 || state != 0) return true;
      std::this_thread::sleep_for(5ms);
    }
    return false;
  }
  messages::NotLetIn notLetIn() const {
    return support::TestHost::connect(plainUri())->ask<messages::Status>().not_let_in;
  }
};

TEST_F(Attacks, LeaveNothingBehindAndKeepNobodyOut) {
  start("");
  become(shop.person("Ada"));
  ASSERT_TRUE(probebox({"status"}));
  const auto before = filesOfDaemon();

  support::Shop stranger{folder / "stranger"};
  const auto expired = shop.make("old", {.name = "Ada", .first_day = -9, .last_day = -3});
  EXPECT_TRUE(isRefused({})) << "no certificate";
  EXPECT_TRUE(isRefused(RawClient::with(stranger.person("Ada"))));
  EXPECT_TRUE(isRefused(RawClient::with(expired)));
  EXPECT_TRUE(isRefused([](SSL_CTX* context) { SSL_CTX_set_max_proto_version(context, TLS1_2_VERSION); }));
  std::mt19937_64 random{3};
  auto noise = std::vector<std::byte>(200'000);
  for (auto& byte : noise) byte = static_cast<std::byte>(random());
  auto huge = bytesOf("\x16\x03\x03\xff\xff");
  huge.resize(100'000);
  for (const auto& bytes : {bytesOf("GET / HTTP/1.1\r\nHost: box\r\n\r\n"), noise, huge}) {
    const auto pipe = connected(door);
    pipe->write(bytes);
    EXPECT_TRUE(isEnded(*pipe));
  }
  for (int k = 0; k < 50; ++k) {  // cut off in the handshake
    const auto carrier = connected(door);
    RawClient client{*carrier, {}};
    client.step();
  }
  const auto refused = notLetIn();
  EXPECT_GE(refused.strangers, 7U);

  // Of 200 that say nothing each holds a place for 2 s at most, and none that anybody else needs.
  std::vector<Pipe> mute;
  for (int k = 0; k < 200; ++k) {
    mute.push_back(connected(door));
    if (k % 20 != 19) continue;
    const auto said = probebox({"status"});
    EXPECT_TRUE(said) << "at the first attempt, beside " << mute.size() << ": " << said.error().what;
  }
  const auto host = support::TestHost::connect(plainUri());
  ASSERT_TRUE(host);
  EXPECT_TRUE(
      host->eventually([&] { return host->ask<messages::Status>().not_let_in.silent >= refused.silent + 200; }));
  for (const auto& pipe : mute) EXPECT_TRUE(isEnded(*pipe));

  EXPECT_TRUE(probebox({"status"}));
  EXPECT_TRUE(host->eventually([&] { return filesOfDaemon() <= before + 1; }))
      << filesOfDaemon() << " files are open, and " << before << " were, without this host's";
}

// A person of the shop is a host like any other: what it sends is read by the same gate and session.
TEST_F(Attacks, APersonWhoSaysSomethingElseThanHelloIsClosed) {
  start("");
  const auto keys = tls::Context::load(tls::Side::host, shop.person("Ada"));
  auto pipe = tls::connect(*keys, connected(door), "localhost", 20s);
  ASSERT_TRUE(pipe);
  const auto before = notLetIn().strangers;
  (*pipe)->write(bytesOf("GET / HTTP/1.1\r\n\r\n"));
  EXPECT_TRUE(isEnded(**pipe));
  EXPECT_EQ(notLetIn().strangers, before + 1);
}

}  // namespace
}  // namespace probebox
