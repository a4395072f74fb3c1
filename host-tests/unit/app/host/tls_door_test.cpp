#include "firmware/app/host/tls_door.hpp"

#include <chrono>
#include <filesystem>
#include <gtest/gtest.h>

#include "drivers/tcp/linux_tcp.hpp"
#include "host-tests/keys/shop.hpp"
#include "host-tests/support/temporary_folder.hpp"

// Keys come, change and are lost while the box serves.
namespace probebox::app {
namespace {

using namespace std::chrono_literals;

class KeysOfADoor : public testing::Test {
 protected:
  static board::TlsKeys of(const tls::KeyFiles& files) {
    return {.certificate = files.certificate, .key = files.key, .people_ca = files.trusted, .shut_out = {}};
  }
  bool takes(const TlsDoor& door) const {
    auto carrier = tcp::connectTcp(listener_.address(), 5s);
    return carrier && door.secure(std::move(*carrier)) != nullptr;
  }
  static void exchange(const tls::KeyFiles& by, const tls::KeyFiles& of) {
    std::filesystem::rename(by.certificate, of.certificate);
    std::filesystem::rename(by.key, of.key);
  }

  const support::TemporaryFolder folder_;
  support::Shop shop_{folder_.path() / "shop"};
  const tcp::Listener listener_{std::move(tcp::Listener::open({"127.0.0.1", 0})).value()};
};

TEST_F(KeysOfADoor, OpenItOnceTheyAreThere) {
  const auto files = shop_.box();
  const auto elsewhere = folder_.path() / "elsewhere.key";
  std::filesystem::rename(files.key, elsewhere);
  EXPECT_TRUE(whyNoKeys(of(files)));
  TlsDoor door{of(files)};
  door.advance(monoTime(1));
  EXPECT_FALSE(takes(door));
  std::filesystem::rename(elsewhere, files.key);
  EXPECT_FALSE(whyNoKeys(of(files)));
  door.advance(monoTime(0) + 10s);
  EXPECT_TRUE(takes(door));
}

TEST_F(KeysOfADoor, ServeOnWhileTheNextOnesAreNotGood) {
  const auto files = shop_.box();
  TlsDoor door{of(files)};
  door.advance(monoTime(1));
  ASSERT_TRUE(takes(door));
  std::filesystem::remove(files.key);
  door.advance(monoTime(0) + 2min);
  EXPECT_TRUE(takes(door));
  exchange(shop_.make("expired", {.name = "PB-1", .first_day = -9, .last_day = -3}), files);
  ASSERT_TRUE(whyNoKeys(of(files)));
  door.advance(monoTime(0) + 4min);
  EXPECT_TRUE(takes(door));
}

}  // namespace
}  // namespace probebox::app
