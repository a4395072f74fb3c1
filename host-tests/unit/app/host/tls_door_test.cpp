#include "firmware/app/host/tls_door.hpp"

#include <chrono>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <iterator>
#include <string>

#include "drivers/tcp/linux_tcp.hpp"
#include "firmware/app/host/key_folder.hpp"
#include "firmware/app/host/unit_request_handler.hpp"
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

// Who is in by a CA that was replaced has to be let go.
TEST_F(KeysOfADoor, SayWhereAnotherCaLetsPeopleIn) {
  const auto files = shop_.box();
  TlsDoor door{of(files)};
  EXPECT_FALSE(door.advance(monoTime(1))) << "the first one";
  EXPECT_FALSE(door.advance(monoTime(0) + 2min)) << "the same one";
  EXPECT_EQ(door.problem(), "");
  support::Shop other{folder_.path() / "other"};
  std::filesystem::rename(other.box().trusted, files.trusted);
  EXPECT_TRUE(door.advance(monoTime(0) + 4min));
  EXPECT_FALSE(door.advance(monoTime(0) + 6min));
  std::filesystem::remove(files.key);
  EXPECT_FALSE(door.advance(monoTime(0) + 8min));
  EXPECT_NE(door.problem(), "");
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

// Whoever holds the cable may renew the box's certificate, and not say who may come in.
TEST_F(KeysOfABox, OfOtherPeopleNeedARightOfTheirOwn) {
  support::Shop other{folder_.path() / "other"};
  const auto first = sent(shop_.box());
  EXPECT_FALSE(keys_.haveOtherPeople(first)) << "there are none yet";
  UnitRequestHandler unit{UnitRecord{(folder_.path() / "unit").string()}, "board", {}, keys_};
  const auto refused = [&](const messages::ProvisionKeys::Request& keys, const board::Access& may) {
    return unit.answer(messages::Operation::provision_keys, messages::encoded(keys), may).code !=
           messages::ErrorCode::ok;
  };
  const board::Access cable{.allow_provision = true}, vendor{.allow_provision = true, .allow_other_people = true};
  EXPECT_TRUE(refused(first, {}));
  EXPECT_FALSE(refused(first, cable));
  EXPECT_FALSE(refused(sent(shop_.make("next", {"PB-1", {}, "serverAuth"})), cable)) << "a renewal";
  EXPECT_TRUE(refused(sent(other.box()), cable));
  EXPECT_TRUE(refused(sent(other.box()), {.allow_other_people = true})) << "it does not provision";
  EXPECT_FALSE(refused(sent(other.box()), vendor));
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
