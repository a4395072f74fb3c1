#include <chrono>
#include <gtest/gtest.h>
#include <optional>
#include <span>
#include <vector>

#include "firmware/app/results/results_in_force.hpp"
#include "firmware/app/wiring/box_config.hpp"
#include "firmware/box/box.hpp"
#include "host-tests/decided/decided.hpp"
#include "host-tests/support/temporary_folder.hpp"

// A box whose inhibit line cannot be read after a start does not know whether a cut is on.
namespace probebox::app {
namespace {

using namespace std::chrono_literals;

struct NoOutputs : box::Outputs {
  bool block(SampleIndex, std::uint32_t, std::span<const std::byte>) override { return true; }
  bool lost(const latch::Lost&) override { return true; }
  void trigger(const box::PlacedTrigger&) override {}
  void state(const box::State&) override {}
  void solve(std::uint32_t) override {}
};

metrology::Result delayOf(double tau_s) {
  metrology::Result result;
  result.method = "delay-multi-speed";
  result.estimates = {metrology::Estimate::scalar("tau_s", tau_s, 4e-6)};
  return result;
}

class UnknownInhibit : public testing::Test {
 protected:
  UnknownInhibit() {
    const auto binding = results_.bindingFor("delay");
    before_ = store_.propose(binding, delayOf(0.004), "", "2026-01-01T00:00:00Z").value();
    next_ = store_.propose(binding, delayOf(0.005), "", "2026-01-01T00:00:00Z").value();
    EXPECT_TRUE(decided::accept(store_, before_, "Ada", "2026-01-01T00:00:00Z"));
    EXPECT_TRUE(decided::accept(store_, next_, "Ada", "2026-01-01T00:00:00Z", true));
  }
  void start() {
    for (const auto& event : results_.restore()) box_.push(event);
    box_.showBeforeStart(now_);
  }
  void run(Nanoseconds duration) {
    for (const auto end = now_ + duration; now_ < end;) {
      now_ += 10ms;
      box_.push(TimeAdvanced{now_});
      results_.look(box_.state());
    }
  }
  void giveLevel(Level level) { box_.push(Edge{LineRole::inhibit, 0, level, 0, now_}); }
  std::uint64_t delayInForce() const { return box_.state().snapshot.delay.result_id; }

  support::TemporaryFolder folder_;
  store::Store store_ = store::Store::open(folder_.file("results.db")).value();
  MonoTime now_{10s};
  NoOutputs outputs_;
  box::Box box_{boxConfig(*board::loadDirectory(PROBEBOX_BOARDS "/receiver")), outputs_};
  ResultsInForce results_{store_,
                          {"P-1001", "mill 3", "spindle"},
                          [this] { return now_; },
                          [](std::span<const Event>) { return std::optional<Error>{}; },
                          [this](const Event& event) { box_.push(event); }};
  store::Id before_{}, next_{};
};

TEST_F(UnknownInhibit, CountsAsACutUntilItsFirstLevelComes) {
  start();
  EXPECT_TRUE(box_.state().snapshot.inhibited) << "also for who asks before the first tick";
  run(3s);
  EXPECT_EQ(delayInForce(), before_) << "what was in force before is no change";
  EXPECT_TRUE(results_.isWaiting(next_));
  EXPECT_EQ(box_.state().snapshot.unknown_inhibit_lines, 1U);
  giveLevel(Level::inactive);
  run(20ms);
  EXPECT_FALSE(results_.isWaiting(next_));
  EXPECT_EQ(delayInForce(), next_);
  EXPECT_EQ(box_.state().snapshot.unknown_inhibit_lines, 0U);
}

TEST_F(UnknownInhibit, IsKnownOnceItHasGivenALevelAndIsLostThen) {
  start();
  giveLevel(Level::active);
  run(2s);
  EXPECT_EQ(box_.state().snapshot.unknown_inhibit_lines, 0U);
  EXPECT_TRUE(results_.isWaiting(next_));
  giveLevel(Level::inactive);
  box_.push(SourceLost{Source::trigger, LossReason::disconnected, 0, now_});
  run(20ms);
  EXPECT_FALSE(results_.isWaiting(next_)) << "a line that is lost keeps its last level";
}

}  // namespace
}  // namespace probebox::app
