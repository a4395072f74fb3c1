// Persons at the door: what they may do, and whose name stands in the history.
#include <fstream>
#include <gmock/gmock.h>
#include <sys/stat.h>

#include "fixture.hpp"

namespace probebox {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kAda =
    "[[person]]\nname = \"Ada\"\nallow_calibrate = true\nallow_accept = true\nallow_inhibit = true\n";

TEST_F(Door, APersonCalibratesAcceptsAndGoesBackInTheirOwnName) {
  start(kAda);
  become(shop.person("Ada"));
  const auto done = probebox({"calibrate", "delay-multi-speed", "--accept"});
  ASSERT_TRUE(done) << done.error().what;
  EXPECT_THAT(*done, HasSubstr(R"("accepted_by":"Ada")"));
  EXPECT_THAT(refusal({"rollback", "delay", "--by", "Zed"}), AllOf(HasSubstr("not_permitted"), HasSubstr("Ada")));
  EXPECT_THAT(refusal({"accept", "1", "--by", "Zed"}), HasSubstr("not_permitted"));
  EXPECT_TRUE(probebox({"rollback", "delay", "--by", "Ada"}));
  const auto history = probebox({"history"});
  ASSERT_TRUE(history);
  EXPECT_THAT(*history, AllOf(HasSubstr(R"("by":"Ada")"), Not(HasSubstr("Zed"))));
  const auto held = probebox({"inhibit", "on"});
  ASSERT_TRUE(held) << held.error().what;
  EXPECT_THAT(*held, HasSubstr("person:Ada")) << "not of the link, which she shares with others";
}

TEST_F(Door, WhoIsNotNamedMayLook) {
  start(kAda);
  become(shop.person("Bob"));
  EXPECT_TRUE(probebox({"status"}));
  EXPECT_TRUE(probebox({"watch", "--count", "2"}));
  const auto recording = (folder / "scan.pbx").string();
  const auto recorded = probebox({"record", "-o", recording, "--for", "1"});
  EXPECT_TRUE(recorded) << recorded.error().what;
  EXPECT_TRUE(tour::outputOf({PROBEBOX, "verify", recording})) << "samples came whole";
  for (const std::vector<std::string>& words : {std::vector<std::string>{"calibrate", "delay-multi-speed"},
                                                {"rollback", "delay"},
                                                {"inhibit", "on"},
                                                {"home", "X=0"},
                                                {"corrections", "--sum", "none"}})
    EXPECT_THAT(refusal(words), HasSubstr("not_permitted")) << words.front();
  const auto host = support::TestHost::connect(uri());
  ASSERT_TRUE(host);
  EXPECT_EQ(host->refusal<messages::AcceptResult>({.id = 1, .by = "Bob"}).code, messages::ErrorCode::not_permitted);
}

TEST_F(Door, IsClosedToStrangersAndTellsThemWhy) {
  support::Shop stranger{folder / "stranger"};
  const auto lost = shop.make("lost", {.name = "Ada"});
  start("shut_out = [\"" + support::Shop::fingerprint(lost) + "\"]\n" + kAda);
  auto of_stranger = stranger.person("Ada");
  of_stranger.trusted = shop.ca();
  become(of_stranger);
  EXPECT_THAT(refusal({"status"}), AllOf(HasSubstr("link-lost"), HasSubstr("CA of your certificate")));
  become(lost);
  EXPECT_THAT(refusal({"status"}), HasSubstr("shut out"));
  become(shop.make("next", {.name = "Ada"}));
  EXPECT_TRUE(probebox({"status"}));
  become(shop.make("old", {.name = "Ada", .first_day = -9, .last_day = -3}));
  EXPECT_THAT(refusal({"status"}), AllOf(HasSubstr("no-permission"), HasSubstr("was valid from")));
  auto wrong_box = shop.person("Ada");
  wrong_box.trusted = stranger.ca();
  become(wrong_box);
  EXPECT_THAT(refusal({"status"}), HasSubstr("boxes.crt"));
  unsetenv("PROBEBOX_TLS");
  setenv("PROBEBOX_TLS", (folder / "nowhere").c_str(), 1);
  EXPECT_THAT(refusal({"status"}), AllOf(HasSubstr("no-permission"), HasSubstr("me.crt"), HasSubstr("probebox-keys")));
  become(shop.person("Ada"));
  EXPECT_TRUE(tour::outputOf({PROBEBOX, "-u", plainUri(), "status"})) << "the plain link is as it was";
}

TEST_F(Door, ABoxWhoseCertificateHasExpiredServesOnWithoutItsDoor) {
  const auto old = shop.make("old", {"PB-1", "DNS:localhost", "serverAuth", -20, -10});
  start("", old);
  EXPECT_TRUE(tour::outputOf({PROBEBOX, "-u", plainUri(), "status"}));
  become(shop.person("Ada"));
  EXPECT_FALSE(probebox({"status"}));
  const auto checked =
      tour::outputOf({PROBEBOXD, "--board", "sim", "--config", (folder / "config").string(), "--check"});
  ASSERT_FALSE(checked);
  EXPECT_THAT(checked.error().what, AllOf(HasSubstr(old.certificate), HasSubstr("was valid from")));
}

// As the vendor of an image does it, over a cable; here over a link that may.
TEST_F(Door, OpensWithKeysThatTheBoxWasProvisionedWith) {
  const auto box = shop.box();
  std::filesystem::rename(box.trusted, shop.folder() / "people.crt");
  std::filesystem::copy_file(shop.folder() / "people.crt", box.trusted);
  startWith("[tls]\n" + std::string{kAda}, "allow_provision = true\n");
  become(shop.person("Ada"));
  EXPECT_FALSE(probebox({"status"}));
  const auto given =
      tour::outputOf({PROBEBOX, "--json", "-u", plainUri(), "provision", "--keys", shop.folder().string()});
  ASSERT_TRUE(given) << given.error().what;
  const auto host = support::TestHost::connect(uri());
  EXPECT_TRUE(host);
  EXPECT_TRUE(probebox({"status"}));
  EXPECT_THAT(refusal({"provision", "--keys", shop.folder().string()}), HasSubstr("not_permitted"));
}

TEST_F(Door, OpensWithKeysThatTheScriptOfTheShopMakes) {
  const auto made_in = (folder / "of-script").string();
  const auto keys = [&](std::vector<std::string> words) {
    std::vector<std::string> command{PROBEBOX_KEYS, "--in", made_in};
    command.insert(command.end(), words.begin(), words.end());
    return tour::outputOf(command);
  };
  if (!tour::outputOf({"openssl", "version"})) GTEST_SKIP() << "openssl is missing: apt-get install openssl";
  EXPECT_FALSE(keys({"person", "Ada Lovelace"})) << "there is no CA yet";
  ASSERT_TRUE(keys({"shop"}));
  EXPECT_FALSE(keys({"shop"})) << "every certificate hangs on the first";
  ASSERT_TRUE(keys({"box", "PB-000123", "localhost", "127.0.0.1"}));
  ASSERT_TRUE(keys({"person", "Ada Lovelace"}));
  EXPECT_FALSE(keys({"person", "Ada Lovelace"})) << "nothing is overwritten";
  EXPECT_FALSE(keys({"person", "\n"}));
  EXPECT_FALSE(keys({"box", "PB 1"})) << "no name by which a computer can be reached";
  EXPECT_TRUE(keys({"box", "PB 1", "localhost"}));
  const auto of = made_in + "/boxes/PB-000123/";
  start("[[person]]\nname = \"Ada Lovelace\"\nallow_inhibit = true\n",
        {of + "box.crt", of + "box.key", of + "people.crt"});
  setenv("PROBEBOX_TLS", (made_in + "/people/Ada_Lovelace").c_str(), 1);
  const auto held = probebox({"inhibit", "on"});
  ASSERT_TRUE(held) << held.error().what;
  EXPECT_THAT(*held, HasSubstr("person:Ada Lovelace"));
  ASSERT_TRUE(keys({"person", "Ada Lovelace", "--renew"}));
  const auto shown = keys({"show", made_in + "/people/Ada_Lovelace.2/me.crt"});
  ASSERT_TRUE(shown);
  EXPECT_THAT(*shown, AllOf(HasSubstr("CN=Ada Lovelace"), HasSubstr("SHA-256: ")));
  struct stat key {};
  ASSERT_EQ(stat((of + "box.key").c_str(), &key), 0);
  EXPECT_EQ(key.st_mode & 07777U, 0600U);
}

}  // namespace
}  // namespace probebox
