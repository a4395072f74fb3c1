#include <chrono>
#include <gmock/gmock.h>

#include "firmware/capture/touch_capture.hpp"
#include "host-tests/emulation/scenario.hpp"

// An encoder that is lost between two touches may count from elsewhere afterwards, by micrometres or by metres.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using procedure::State;

class RunWithoutAnEncoder : public testing::TestWithParam<const procedure::LiveMethod*> {};

TEST_P(RunWithoutAnEncoder, IsRefusedAndTheNextOneIsGood) {
  auto world = usualWorld();
  world.encoders.power_up_mm = {1, 2, 3};  // encoders that have to be referenced
  Scenario scenario{world, 4};
  scenario.recorder().keeps_bytes = false;
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().snapshot.referenced; }, 30s));
  scenario.start(*GetParam());
  const auto& run = scenario.state().procedure;
  ASSERT_TRUE(scenario.runUntil([&] { return run.step == 3 && run.state == State::waiting; }, 120s));
  scenario.push(SourceLost{Source::encoders, LossReason::disconnected, 0, scenario.now(), axisBit(Axis::y)});
  ASSERT_TRUE(scenario.runUntil([&] { return run.state == State::refused; }, 30s));
  EXPECT_EQ(run.last_fault, capture::TouchFault::zero_lost);
  EXPECT_EQ(run.step, 3U);
  const auto next = scenario.calibrate();
  ASSERT_TRUE(next);
  EXPECT_TRUE(next->ok()) << next->error().reason;
}

INSTANTIATE_TEST_SUITE_P(OfMethods, RunWithoutAnEncoder,
                         testing::Values(&procedure::kDelayMultiSpeed, &procedure::kDelayPerAxis),
                         [](const auto& named) {
                           return named.param->name() == "delay-per-axis" ? "PerAxis" : "MultiSpeed";
                         });

// Positions of the tool hold the expansion of warm screws by the result that is in force.
TEST(RunAcrossAResultAboutAScrew, IsRefusedAndTheCorrectionFollowsAtOnce) {
  Scenario scenario{warmingWorld(), 4};
  scenario.recorder().keeps_bytes = false;
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().snapshot.referenced; }, 30s));
  scenario.run(20s);
  scenario.start(procedure::kDelayMultiSpeed);
  const auto& run = scenario.state().procedure;
  ASSERT_TRUE(scenario.runUntil([&] { return run.step == 3 && run.state == State::waiting; }, 120s));
  const auto slope = [&] { return scenario.state().snapshot.axes[0].screw.slope; };
  const double before = slope();
  scenario.push(ScrewActivated{
      .result_id = 9, .axis = Axis::x, .gain = 0.5, .sd_gain = 0, .sectors = 0, .sector_nm = {}, .at = scenario.now()});
  scenario.run(100ms);
  EXPECT_LT(slope() / before, 0.7);
  ASSERT_TRUE(scenario.runUntil([&] { return run.state == State::refused; }, 30s));
  EXPECT_EQ(run.last_fault, capture::TouchFault::screw_changed);
  EXPECT_EQ(run.step, 3U);
}

}  // namespace
}  // namespace probebox::scenario
