#include "firmware/app/update/update_request_handler.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "sent_bundle.hpp"

namespace probebox::app {
namespace {

using messages::ErrorCode;
using messages::UpdateState;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class UpdateDeskTest : public testing::Test {
 protected:
  void hand(const std::string& bytes) {
    box_.sendAll(bytes, box_.offer(bytes));
    installation_ = box_.install();
    box_.look();
  }
  void reportState(const std::string& state, const std::string& more = {}) {
    box_.report("state " + state + "\ninstallation " + std::to_string(installation_) + "\nversion 2\nrunning 1\n" +
                more);
    box_.look();
  }

  const support::TemporaryFolder folder_;
  SentBundle box_{folder_.path()};
  std::uint64_t installation_{};
};

TEST_F(UpdateDeskTest, HandsTheWholeBundleToTheUpdater) {
  const auto bytes = bundleBytes(3'000'000);
  EXPECT_EQ(box_.offer(bytes), 0U);
  box_.sendAll(bytes);
  EXPECT_EQ(box_.status().state, UpdateState::receiving);
  EXPECT_FALSE(std::filesystem::exists(box_.requests() / "request"));
  installation_ = box_.install();
  EXPECT_EQ(box_.status().state, UpdateState::checking);
  box_.look();
  EXPECT_EQ(box_.status().state, UpdateState::waiting);
  EXPECT_EQ(textIn(box_.requests() / "bundle"), bytes);
  EXPECT_EQ(textIn(box_.requests() / "request"), std::to_string(installation_) + " newer\n");
}

TEST_F(UpdateDeskTest, TellsWhatTheUpdaterDoes) {
  hand(bundleBytes(10'000));
  reportState("installing", "percent 40\ntext copying\n");
  const auto status = box_.status();
  EXPECT_EQ(status.state, UpdateState::installing);
  EXPECT_EQ(status.installation, installation_);
  EXPECT_EQ(status.percent, 40);
  EXPECT_EQ(status.running_version, "1");
  EXPECT_EQ(status.text, "copying");
  EXPECT_THAT(box_.handler->inWords(), testing::AllOf(HasSubstr("version 2"), HasSubstr("40 %"), HasSubstr("copying")));
  EXPECT_THAT(box_.offerReply(bundleBytes(5)).text, StartsWith("update-busy"));
  reportState("done");
  EXPECT_EQ(box_.status().state, UpdateState::done);
  EXPECT_FALSE(std::filesystem::exists(box_.requests() / "bundle")) << "it is not needed any more";
  EXPECT_EQ(box_.offer(bundleBytes(5)), 0U);
}

TEST_F(UpdateDeskTest, RestartsTheBoxOnlyWhenNeitherACutNorARunIsOn) {
  hand(bundleBytes(10'000));
  box_.machine.cut_is_on = true;
  reportState("installed");
  EXPECT_FALSE(std::filesystem::exists(box_.requests() / "restart"));
  EXPECT_THAT(box_.status().why_not, StartsWith("cut-on"));
  box_.machine = {.cut_is_on = false, .run_is_on = true};
  box_.look();
  EXPECT_FALSE(std::filesystem::exists(box_.requests() / "restart"));
  box_.machine = {};
  box_.look();
  EXPECT_TRUE(std::filesystem::exists(box_.requests() / "restart"));
}

TEST_F(UpdateDeskTest, ARefusedBundleStaysForASecondTry) {
  const auto bytes = bundleBytes(10'000);
  hand(bytes);
  reportState("not_installed", "text not-newer: 2 is not above 2\n");
  auto status = box_.status();
  EXPECT_EQ(status.state, UpdateState::not_installed);
  EXPECT_EQ(status.installation, installation_);
  EXPECT_THAT(status.text, StartsWith("not-newer"));
  EXPECT_EQ(box_.offer(bytes), bytes.size()) << "nothing is sent again";
  installation_ = box_.install(true);
  box_.look();
  EXPECT_EQ(textIn(box_.requests() / "request"), std::to_string(installation_) + " although-not-newer\n");
  EXPECT_EQ(box_.status().state, UpdateState::waiting) << "what the updater said before is about another one";
}

TEST_F(UpdateDeskTest, FollowsAnInstallationOverARestart) {
  hand(bundleBytes(10'000));
  box_.restart();
  EXPECT_EQ(box_.status().state, UpdateState::waiting);
  EXPECT_EQ(box_.status().installation, installation_);
  reportState("gone_back", "text version 2 was not found healthy\n");
  EXPECT_EQ(box_.status().state, UpdateState::gone_back);
  box_.restart();
  EXPECT_EQ(box_.status().state, UpdateState::gone_back);
  EXPECT_THAT(box_.handler->inWords(), testing::AllOf(HasSubstr("given up"), HasSubstr("version 2")));
}

TEST_F(UpdateDeskTest, AnUpdaterThatIsSilentIsGivenUp) {
  hand(bundleBytes(10'000));
  box_.look(UpdateRequestHandler::kUntaken - std::chrono::seconds{1});
  EXPECT_EQ(box_.status().state, UpdateState::waiting);
  box_.look(std::chrono::seconds{2});
  EXPECT_EQ(box_.status().state, UpdateState::not_installed);
  EXPECT_THAT(box_.status().text, StartsWith("updater-silent"));
  EXPECT_FALSE(std::filesystem::exists(box_.requests() / "request"));
}

// It reports before it removes a request, unless the power or its disk failed.
TEST_F(UpdateDeskTest, AnUpdaterThatTookTheRequestAndSaysNothingIsGivenUp) {
  hand(bundleBytes(10'000));
  std::filesystem::remove(box_.requests() / "request");
  box_.look(UpdateRequestHandler::kUnreported - std::chrono::seconds{1});
  EXPECT_EQ(box_.status().state, UpdateState::waiting);
  box_.look(std::chrono::seconds{2});
  EXPECT_EQ(box_.status().state, UpdateState::not_installed);
  EXPECT_THAT(box_.status().text, StartsWith("updater-silent"));
  EXPECT_EQ(box_.offerReply(bundleBytes(10'000)).code, ErrorCode::ok) << "the next one is taken";
}

TEST_F(UpdateDeskTest, TellsTheVersionThatRunsAsSoonAsTheUpdaterHasReported) {
  EXPECT_EQ(box_.status().running_version, "");
  std::ofstream{box_.reports() / "state"} << "state none\nrunning 7.1\n";
  EXPECT_EQ(box_.status().running_version, "7.1");
}

TEST_F(UpdateDeskTest, ABundleWithAnotherHashIsRefusedAndRemoved) {
  auto bytes = bundleBytes(2'500'000);
  const auto sha256 = sha256Of(bytes);
  bytes[2'000'000] ^= 1;
  EXPECT_EQ(box_.offer(bytes, sha256), 0U);
  box_.sendAll(bytes);
  installation_ = box_.install();
  box_.look();
  EXPECT_EQ(box_.status().state, UpdateState::not_installed);
  EXPECT_EQ(box_.status().installation, installation_);
  EXPECT_THAT(box_.status().text, StartsWith("hash-mismatch"));
  EXPECT_FALSE(std::filesystem::exists(box_.requests() / "bundle"));
  EXPECT_FALSE(std::filesystem::exists(box_.requests() / "request"));
  for (const auto& open : std::filesystem::directory_iterator{"/proc/self/fd"}) {
    std::error_code closed;
    EXPECT_THAT(std::filesystem::read_symlink(open.path(), closed).string(),
                Not(StartsWith((box_.requests() / "bundle").string())))
        << "as long as it is open, it fills the disk";
  }
  EXPECT_EQ(box_.offer(bytes, sha256), 0U) << "nothing of it is left";
}

TEST_F(UpdateDeskTest, NothingIsTakenDuringACutOrARun) {
  const auto bytes = bundleBytes(8'000);
  const auto refuse_all = [&](const char* why) {
    for (const auto& reply : {box_.offerReply(bytes), box_.send(bytes, 4'000, 4'000),
                              box_.ask<messages::InstallUpdate>({.offer = box_.offered})}) {
      EXPECT_EQ(reply.code, ErrorCode::wrong_state);
      EXPECT_THAT(reply.text, StartsWith(why));
    }
  };
  box_.offer(bytes);
  box_.send(bytes, 0, 4'000);
  box_.machine.cut_is_on = true;
  refuse_all("cut-on");
  box_.machine = {.cut_is_on = false, .run_is_on = true};
  refuse_all("run-on");
  box_.machine = {};
  EXPECT_EQ(box_.offer(bytes), 4'000U) << "and what came before is kept";
}

TEST_F(UpdateDeskTest, NothingIsTakenBeforeTheRunningVersionIsConfirmed) {
  const auto bytes = bundleBytes(8'000);
  box_.confirmed = false;
  EXPECT_EQ(box_.offerReply(bytes).code, ErrorCode::wrong_state);
  EXPECT_THAT(box_.offerReply(bytes).text, StartsWith("not-confirmed: the version that runs"));
  EXPECT_THAT(box_.status().why_not, StartsWith("not-confirmed"));
  box_.confirmed = true;
  box_.sendAll(bytes, box_.offer(bytes));
  box_.confirmed = false;
  EXPECT_THAT(box_.ask<messages::InstallUpdate>({.offer = box_.offered}).text, StartsWith("not-confirmed"));
  box_.confirmed = true;
  EXPECT_EQ(box_.status().why_not, "");
  EXPECT_EQ(box_.offer(bytes), bytes.size()) << "what came before is kept";
}

TEST_F(UpdateDeskTest, AConnectionWithoutTheRightMayOnlyLook) {
  const auto bytes = bundleBytes(100);
  box_.offer(bytes);
  box_.may = {
      .allow_marker = true, .allow_homing = true, .allow_inhibit = true, .allow_calibrate = true, .allow_accept = true};
  for (const auto& reply :
       {box_.offerReply(bytes), box_.send(bytes, 0, 100), box_.ask<messages::InstallUpdate>({.offer = box_.offered})}) {
    EXPECT_EQ(reply.code, ErrorCode::not_permitted);
    EXPECT_THAT(reply.text, HasSubstr("allow_update"));
  }
  EXPECT_EQ(box_.status().state, UpdateState::receiving);
}

TEST_F(UpdateDeskTest, ABoxWithoutAnUpdaterTakesNothingAndTouchesNoFile) {
  const support::TemporaryFolder folder;
  SentBundle box{folder.path(), false};
  EXPECT_THAT(box.offerReply(bundleBytes(5)).text, StartsWith("no-updater"));
  EXPECT_THAT(box.status().why_not, StartsWith("no-updater"));
  EXPECT_FALSE(std::filesystem::exists(box.requests()));
  EXPECT_EQ(box.handler->inWords(), "");
}

TEST_F(UpdateDeskTest, OneBundleAtATime) {
  const auto one = bundleBytes(8'000, 1), other = bundleBytes(8'000, 2);
  box_.offer(one);
  const auto offer_of_one = box_.offered;
  box_.send(one, 0, 4'000);
  box_.now += UpdateRequestHandler::kAbandoned - std::chrono::seconds{1};
  EXPECT_EQ(box_.offerReply(other).code, ErrorCode::busy);
  box_.now += std::chrono::seconds{2};
  EXPECT_EQ(box_.offer(other), 0U) << "its host has stopped";
  box_.offered = offer_of_one;
  EXPECT_EQ(box_.send(one, 4'000, 4'000).code, ErrorCode::not_found) << "it would go into the other one";
}

TEST_F(UpdateDeskTest, ABundleThatIsTooLargeIsRefusedByName) {
  for (const std::uint64_t size :
       {BundleFile::kMost + 1, std::uint64_t{1} << 50U, ~std::uint64_t{0}, (~std::uint64_t{0} >> 1U) + 2}) {
    const auto reply =
        box_.ask<messages::OfferUpdate>({.name = "huge", .version = {}, .total_bytes = size, .sha256 = {}});
    EXPECT_EQ(reply.code, ErrorCode::refused) << size;
    EXPECT_THAT(reply.text, StartsWith("too-large"));
  }
}

// What has come over the line is on the disk after a second or two.
TEST_F(UpdateDeskTest, ASlowLineLosesLittleByAKill) {
  const auto bytes = bundleBytes(100'000);
  box_.offer(bytes);
  box_.send(bytes, 0, 4'000);
  box_.look(std::chrono::milliseconds{100});
  EXPECT_EQ(box_.answered<messages::SendUpdate>({.offer = box_.offered, .offset = 0, .bytes = {}}).stored_bytes, 0U);
  box_.look(std::chrono::seconds{2});
  EXPECT_EQ(box_.answered<messages::SendUpdate>({.offer = box_.offered, .offset = 0, .bytes = {}}).stored_bytes,
            4'000U);
  box_.restart();
  EXPECT_EQ(box_.offer(bytes), 4'000U);
}

// Parts in any order, twice, with gaps, of any length, beyond the end, and restarts in between: what is handed over is
// the bundle, and nothing else ever is.
TEST(UpdateDeskProperty, WhateverComesTheFileIsTheBundleOrARefusal) {
  EXPECT_TRUE(rc::check("the bundle, or a refusal", [] {
    const support::TemporaryFolder folder{support::inMemory()};
    SentBundle box{folder.path()};
    const auto bytes = bundleBytes(*rc::gen::inRange<std::size_t>(1, 20'000), *rc::gen::inRange(0U, 1000U));
    const bool damaged = *rc::gen::weightedElement<bool>({{4, false}, {1, true}});
    auto sent = bytes;
    if (damaged) sent[*rc::gen::inRange<std::size_t>(0, sent.size())] ^= 1;
    box.offer(bytes);
    for (int act = *rc::gen::inRange(0, 30); act > 0; --act) {
      switch (*rc::gen::inRange(0, 6)) {
        case 0:
          box.restart();
          box.offer(bytes);
          break;
        case 1:
          box.look(std::chrono::seconds{*rc::gen::inRange(0, 4)});
          break;
        case 2:
          RC_ASSERT(
              box.ask<messages::SendUpdate>({.offer = box.offered, .offset = bytes.size(), .bytes = {std::byte{1}}})
                  .code == ErrorCode::malformed);
          break;
        default: {  // mostly around the end of what the box holds
          const auto near = std::int64_t(box.status().received_bytes) + *rc::gen::inRange(-2'500, 500);
          const auto offset = std::clamp<std::int64_t>(near, 0, std::int64_t(bytes.size()));
          box.send(sent, static_cast<std::size_t>(offset), *rc::gen::inRange<std::size_t>(0, 4001));
        }
      }
    }
    const bool early = *rc::gen::arbitrary<bool>();
    const std::uint64_t held = box.offer(bytes);
    if (early && held < bytes.size()) {
      RC_ASSERT(box.ask<messages::InstallUpdate>({.offer = box.offered}).code == ErrorCode::wrong_state);
    }
    box.sendAll(sent, held);
    box.install();
    box.look();
    RC_ASSERT(std::filesystem::exists(box.requests() / "request") == !damaged);
    RC_ASSERT(box.status().state == (damaged ? UpdateState::not_installed : UpdateState::waiting));
    if (!damaged) RC_ASSERT(textIn(box.requests() / "bundle") == bytes);
  }));
}

}  // namespace
}  // namespace probebox::app
