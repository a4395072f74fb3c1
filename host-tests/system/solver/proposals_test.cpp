#include <chrono>
#include <filesystem>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <thread>

#include "firmware/app/wiring/daemon.hpp"
#include "host-tests/host/test_host.hpp"
#include "protocol/messages/cases.hpp"
#include "sphere_case.hpp"

// Cases that hosts propose to a daemon, which goes on whatever becomes of them.
namespace probebox::app {
namespace {

using namespace std::chrono_literals;
using messages::CaseProgress;
using messages::FollowCase;
using messages::ProposeCase;
using testing::HasSubstr;

class Proposals : public testing::Test {
 protected:
  void start(const std::filesystem::path& solver = PROBEBOXD) {
    setenv("XDG_RUNTIME_DIR", folder.path().c_str(), 1);
    options.state = folder.file("state");
    options.links = {"tcp:127.0.0.1:0"};
    options.solver = solver;
    const auto descriptions = loadDescriptions(options);
    ASSERT_TRUE(descriptions) << descriptions.error().what;
    auto started = Daemon::start(options, *descriptions);
    ASSERT_TRUE(started) << started.error().what;
    daemon = std::move(*started);
    host = support::TestHost::connect(daemon->uris().front());
  }

  // All pieces of a case but the answer to the last one, which it gives.
  ProposeCase::Request lastPieceOf(const metrology::Dataset& dataset, std::uint32_t number, bool follow) {
    ProposeCase::Request piece{.number = number, .first = true, .method = dataset.method};
    for (const auto& column : dataset.tables.front().columns) {
      for (std::size_t at = 0; at < column.values.size(); at += 300) {
        const auto from = column.values.begin() + static_cast<std::ptrdiff_t>(at);
        const auto count = std::min<std::size_t>(300, column.values.size() - at);
        piece.columns = {
            {.table = "points", .column = column.name, .values = {from, from + static_cast<std::ptrdiff_t>(count)}}};
        host->ask<ProposeCase>(piece);
        piece.first = false;
      }
    }
    return {.number = number, .last = true, .follow = follow, .as_this_machine = true, .by = "Ada"};
  }
  // What the box says of the case once it is not working on it any more.
  FollowCase::Answer outcomeOf(std::uint32_t number) {
    FollowCase::Answer answer;
    EXPECT_TRUE(host->eventually([&] {
      answer = host->ask<FollowCase>({.number = number});
      return answer.progress != CaseProgress::working;
    }));
    return answer;
  }
  std::size_t kept() { return host->ask<messages::ResultHistory>({}).transitions.size(); }

  const support::TemporaryFolder folder;
  Options options;
  std::unique_ptr<Daemon> daemon;
  std::unique_ptr<support::TestHost> host;
};

TEST_F(Proposals, AreSolvedInAProcessOfTheirOwnAndKept) {
  start();
  const auto answer = host->ask<ProposeCase>(lastPieceOf(sphereCase(40), 7, true));
  EXPECT_TRUE(answer.working);
  const auto outcome = outcomeOf(7);
  EXPECT_EQ(outcome.progress, CaseProgress::done);
  EXPECT_EQ(outcome.refusal, "");
  const auto results = host->ask<messages::ListResults>().results;
  ASSERT_EQ(results.size(), 1U);
  EXPECT_EQ(results[0].id, outcome.result_id);
  EXPECT_EQ(results[0].values.front().key, "centre_mm[0]");
  EXPECT_NEAR(results[0].values.front().value, 10, 1e-3);
}

// A case of no stated probe, machine or mounting may be of another machine.
TEST_F(Proposals, ThatNameNoMachineNeedAPersonWhoSaysThatItIsThisOne) {
  start();
  auto nameless = lastPieceOf(sphereCase(40), 7, false);
  nameless.as_this_machine = false;
  EXPECT_THAT(host->refusal<ProposeCase>(nameless).what,
              testing::AllOf(HasSubstr("with which"), HasSubstr("--as-this-machine")));
  for (const char* nobody : {"", "  "}) {
    auto blank = lastPieceOf(sphereCase(40), 8, false);
    blank.by = nobody;
    EXPECT_THAT(host->refusal<ProposeCase>(blank).what, HasSubstr("person"));
  }
  EXPECT_EQ(kept(), 0U);
  const auto id = host->ask<ProposeCase>(lastPieceOf(sphereCase(40), 9, false)).result_id;
  const auto history = host->ask<messages::ResultHistory>({.id = id}).transitions;
  ASSERT_EQ(history.size(), 1U);
  EXPECT_EQ(history[0].by, "Ada");
  EXPECT_EQ(history[0].remark, "as this machine");
  EXPECT_EQ(host->ask<messages::ListResults>().results.at(0).as_this_machine_by, "Ada");
}

// What a result rests on can be retired; a number that means something else here would never be.
TEST_F(Proposals, ThatNameResultsOfAnotherStoreAreRefused) {
  start();
  auto piece = lastPieceOf(sphereCase(40), 7, false);
  piece.config = {{.key = "delay_result", .kind = messages::CaseValue::number, .numbers = {9999}}};
  EXPECT_THAT(host->refusal<ProposeCase>(piece).what,
              testing::AllOf(HasSubstr("unknown-result: "), HasSubstr("9999"), HasSubstr("not keep")));
  const auto sphere = host->ask<ProposeCase>(lastPieceOf(sphereCase(40), 8, false)).result_id;
  piece = lastPieceOf(sphereCase(40), 9, false);
  piece.config = {
      {.key = "delay_result", .kind = messages::CaseValue::number, .numbers = {static_cast<double>(sphere)}}};
  EXPECT_THAT(host->refusal<ProposeCase>(piece).what, HasSubstr("is about"));
  EXPECT_EQ(kept(), 1U);
}

// The emulated machine has 0.02 mm.
TEST_F(Proposals, OfAWiderLimitThanTheMachinesAreRefused) {
  start();
  auto check = sphereCase(40);
  check.method = "periodic-check";
  auto piece = lastPieceOf(check, 7, false);
  piece.config = {{.key = "limit_mm", .kind = messages::CaseValue::number, .numbers = {1}}};
  EXPECT_THAT(host->refusal<ProposeCase>(piece).what,
              testing::AllOf(HasSubstr("other-limit: "), HasSubstr("limit_mm = 1"), HasSubstr("0.02")));
}

TEST_F(Proposals, AreAnsweredAtOnceToHostsThatDoNotFollow) {
  start();
  const auto answer = host->ask<ProposeCase>(lastPieceOf(sphereCase(40), 7, false));
  EXPECT_FALSE(answer.working);
  EXPECT_NE(answer.result_id, 0U);
}

TEST_F(Proposals, ThatEndTheSolverAreKeptAsRefusalsAndTheBoxGoesOn) {
  start(programThat(folder, "kill -SEGV $$"));
  for (std::uint32_t number = 1; number <= 3; ++number) {
    host->ask<ProposeCase>(lastPieceOf(sphereCase(40), number, true));
    const auto outcome = outcomeOf(number);
    EXPECT_THAT(outcome.refusal, HasSubstr("solver-ended: "));
    EXPECT_EQ(kept(), number);
  }
}

// The solver does nothing for as long as the test wants it.
TEST_F(Proposals, LeaveTheBoxAtWorkWhileTheyAreSolved) {
  start(programThat(folder, "exec sleep 600"));
  host->ask<ProposeCase>(lastPieceOf(sphereCase(40), 7, true));
  daemon->condition(300ms);  // counts from here
  int went_on = 0;
  for (int look = 0; look < 20; ++look) {
    std::this_thread::sleep_for(100ms);
    went_on += daemon->condition(300ms).goes_on ? 1 : 0;
    EXPECT_EQ(host->ask<FollowCase>({.number = 7}).progress, CaseProgress::working);
  }
  EXPECT_GE(went_on, 4) << "the watchdog is fed";
  EXPECT_EQ(host->refusal<ProposeCase>({.number = 8, .first = true, .method = "sphere-fit"}).code,
            messages::ErrorCode::busy);
  EXPECT_EQ(host->ask<FollowCase>({.number = 7, .cancel = true}).progress, CaseProgress::cancelled);
  EXPECT_EQ(kept(), 0U);
  EXPECT_EQ(host->refusal<FollowCase>({.number = 7}).code, messages::ErrorCode::not_found);
}

TEST_F(Proposals, ThatNobodyAsksAfterAreGivenUpAndNotKept) {
  start(programThat(folder, "sleep 8; echo refusal; echo '{\"name\": \"late\", \"reason\": \"\"}'"));
  host->ask<ProposeCase>(lastPieceOf(sphereCase(40), 7, true));
  host.reset();
  std::this_thread::sleep_for(10s);
  host = support::TestHost::connect(daemon->uris().front());
  EXPECT_EQ(kept(), 0U);
  EXPECT_EQ(host->refusal<FollowCase>({.number = 7}).code, messages::ErrorCode::not_found);
}

TEST_F(Proposals, OfHostsThatDoNotFollowAreGivenUpBeforeThoseGiveUp) {
  start(programThat(folder, "exec sleep 600"));
  const auto refusal = host->refusal<ProposeCase>(lastPieceOf(sphereCase(40), 7, false));
  EXPECT_THAT(refusal.what, HasSubstr("too-long"));
  EXPECT_EQ(kept(), 0U);
}

}  // namespace
}  // namespace probebox::app
