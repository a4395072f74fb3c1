#include "firmware/app/host/tls_door.hpp"

#include <chrono>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <string>

#include "drivers/tcp/linux_tcp.hpp"
#include "firmware/app/host/key_folder.hpp"
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

class KeysOfABox : public KeysOfADoor {
 protected:
  static std::string textIn(const std::string& path) {
    std::ifstream file{path};
    return {std::istreambuf_iterator<char>{file}, {}};
  }
  static messages::ProvisionKeys::Request sent(const tls::KeyFiles& files) {
    return {textIn(files.certificate), textIn(files.key), textIn(files.trusted)};
  }
  const KeyFolder keys_{folder_.path()};
};

TEST_F(KeysOfABox, AreThoseThatItWasProvisionedWithUnlessServiceTomlNamesOthers) {
  const auto box = shop_.box();
  EXPECT_EQ(keys_.in(of(box)).certificate, box.certificate);
  EXPECT_TRUE(whyNoKeys(keys_.in({}))) << "there are none yet";
  EXPECT_FALSE(keys_.write(sent(box)));
  EXPECT_FALSE(whyNoKeys(keys_.in({})));
  EXPECT_EQ(keys_.in({.certificate = {}, .key = {}, .people_ca = {}, .shut_out = {"ab"}}).shut_out.size(), 1U);
  EXPECT_EQ(std::filesystem::status(keys_.in({}).key).permissions(),
            std::filesystem::perms::owner_read | std::filesystem::perms::owner_write);
}

TEST_F(KeysOfABox, AreReplacedAsAWholeOrStay) {
  ASSERT_FALSE(keys_.write(sent(shop_.box())));
  const auto before = textIn(keys_.in({}).certificate);
  auto torn = sent(shop_.make("next", {"PB-1", {}, "serverAuth"}));
  const auto next = torn;
  torn.key = textIn(shop_.person("Ada").key);
  EXPECT_TRUE(keys_.write(torn));
  EXPECT_TRUE(keys_.write({}));
  EXPECT_TRUE(keys_.write(sent(shop_.make("old", {.name = "PB-1", .first_day = -9, .last_day = -3}))));
  EXPECT_EQ(textIn(keys_.in({}).certificate), before);
  EXPECT_FALSE(whyNoKeys(keys_.in({})));
  EXPECT_FALSE(keys_.write(next));
  EXPECT_EQ(textIn(keys_.in({}).certificate), next.certificate);
  EXPECT_FALSE(whyNoKeys(keys_.in({})));
}

}  // namespace
}  // namespace probebox::app
