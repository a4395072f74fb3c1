#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <vector>

#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/procedure.hpp"
#include "firmware/procedure/plan/prompts.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "refusal.hpp"

// The plan of tool-setter, what it needs, and which tool has to be in the spindle.
namespace probebox::procedure {
namespace {

using testing::HasSubstr;

std::unique_ptr<Plan> planned(const ProcedureOptions& options, const LiveMethod& method = kToolSetter) {
  auto plan = std::make_unique<Plan>();
  fill(*plan, method, options);
  return plan;
}

TEST(SetterPlan, TouchesTheSameFacesWithTheProbeAndThenWithTheTool) {
  const auto plan = planned({.tool = 7});
  ASSERT_EQ(plan->step_count, 42U);
  for (std::size_t k = 36; k < 42; ++k) EXPECT_EQ(plan->steps[k].touch.tool, 0U) << "the probe once more";
  for (std::size_t k = 0; k < 18; ++k) {
    const Step &of_probe = plan->steps[k], &of_tool = plan->steps[k + 18];
    EXPECT_EQ(of_probe.touch.tool, 0U);
    EXPECT_EQ(of_tool.touch.tool, 7U);
    EXPECT_TRUE(of_probe.touch.by_edges && of_tool.touch.by_edges);
    EXPECT_TRUE(of_tool.turns) << "the tool stands in the spindle as the probe did";
    EXPECT_EQ(of_tool.feature, Feature::tool_setter);
    EXPECT_EQ(of_probe.touch.outward_normal, of_tool.touch.outward_normal);
    EXPECT_EQ(of_probe.touch.retract_speed_mm_s, of_tool.touch.retract_speed_mm_s);
    EXPECT_EQ(of_tool.touch.reading, k / 6 + 3);
    EXPECT_NE(of_tool.touch.outward_normal[2], -1) << "it stands on that face";
  }
  EXPECT_THAT(promptFor(*plan, 0), HasSubstr("+X face"));
  EXPECT_THAT(promptFor(*plan, 18), HasSubstr("tool 7"));
  EXPECT_THAT(promptFor(*plan, 18), testing::AllOf(HasSubstr("0.5 mm"), HasSubstr("5 mm/s")));
}

TEST(SetterPlan, NeedsANumberAndWayAboutTheEdges) {
  EXPECT_THAT(refusal(kToolSetter, {}), HasSubstr("--tool"));
  EXPECT_THAT(refusal(kToolSetter, {.overtravel_mm = 0.2, .tool = 7}), HasSubstr("0.3 to 100 mm"));
  EXPECT_THAT(refusal(kToolSetter, {.clearance_mm = 0.2, .tool = 7}), HasSubstr("0.3 to 10 mm"));
  EXPECT_THAT(refusal(kToolSetter, {.balls = 2, .tool = 7}), HasSubstr("balls"));
  EXPECT_THAT(refusal(kCentreline, {.tool = 7}), HasSubstr("no tool"));
  EXPECT_EQ(refusal(kToolSetter, {.tool = 7}), "");
}

TEST(SetterPlan, NeedsADeviceADelayAndAKnownTool) {
  Facts facts;
  EXPECT_THAT(whyUnready(kToolSetter, facts, true)->what,
              testing::AllOf(HasSubstr("[tool_setter]"), HasSubstr("machine.toml")));
  facts.tool_setter.emplace();
  facts.tools = {{.number = 4}, {.number = 9}};
  EXPECT_THAT(whyUnready(kToolSetter, facts, false)->what, HasSubstr("calibrate"));
  EXPECT_FALSE(whyUnready(kToolSetter, facts, true));
  EXPECT_TRUE(kToolSetter.finds_a_place);
  EXPECT_THAT(kToolSetter.why_unfit({.tool = 7}, facts)->what,
              testing::AllOf(HasSubstr("[[tool]]"), HasSubstr("number 7"), HasSubstr("of 4, 9")));
  EXPECT_FALSE(kToolSetter.why_unfit({.tool = 9}, facts));
  EXPECT_EQ(kCentreline.why_unfit, nullptr) << "the method measures no tool";
}

// Which faces an axis it asks for, where the head swivels.
TEST(SetterPlan, AsksALatheWithoutYForNoFaceAlongIt) {
  Facts facts;
  facts.tool_setter.emplace().swivels_rad = {0, 1};
  facts.swivel_head.emplace();
  facts.tools = {{.number = 4}};
  for (const bool has_y : {true, false}) {
    facts.has_y = has_y;
    const auto options = kToolSetter.described({.tool = 4}, facts);
    ASSERT_FALSE(options);
    EXPECT_THAT(options.error().what, HasSubstr("+X"));
    EXPECT_EQ(options.error().what.find("+Y") != std::string::npos, has_y);
  }
}

TEST(AssemblyPlan, TouchesWithTheToolAlone) {
  const auto plan = planned({.tool = 7}, kToolAssembly);
  ASSERT_EQ(plan->step_count, 18U);
  for (std::size_t k = 0; k < 18; ++k) {
    EXPECT_EQ(plan->steps[k].touch.tool, 7U);
    EXPECT_EQ(plan->steps[k].touch.reading, k / 6);
    EXPECT_TRUE(plan->steps[k].touch.by_edges);
  }
  EXPECT_THAT(refusal(kToolAssembly, {}), HasSubstr("--tool"));
}

TEST(AssemblyPlan, NeedsAUnitWithAKnownPlaceAndAHolder) {
  Facts facts;
  facts.tool_setter.emplace();
  facts.tools = {{.number = 4, .holder = HolderFacts{.number = 2, .length_mm = 60, .sd_mm = 0}}, {.number = 9}};
  EXPECT_THAT(whyUnready(kToolAssembly, facts, true)->what,
              testing::AllOf(HasSubstr("accepted_mm"), HasSubstr("machine.toml")));
  facts.tool_setter->accepted_mm = {0, 0, 0};
  EXPECT_FALSE(whyUnready(kToolAssembly, facts, true));
  EXPECT_FALSE(kToolAssembly.why_unfit({.tool = 4}, facts));
  EXPECT_THAT(kToolAssembly.why_unfit({.tool = 9}, facts)->what, HasSubstr("[[holder]]"));
  EXPECT_FALSE(kToolSetter.why_unfit({.tool = 9}, facts)) << "its length does not matter there";
}

// A box at the first step of a run, or at the first one with the tool.
class SetterRun : public testing::Test {
 protected:
  SetterRun() { procedure_.start({.run = 1, .method = kToolSetter.number, .at = {}, .options = {.tool = 7}}); }
  void begin(std::uint32_t tool) {
    procedure_.mark({.procedure = 1,
                     .step = procedure_.progress().step,
                     .phase = MarkerPhase::begin,
                     .rotary_angles_rad = {},
                     .tool = tool,
                     .nominal_speed_mm_s = 5,
                     .at_rest = true,
                     .at = monoTime(0)},
                    kLocked);
  }
  void end() {
    procedure_.mark({.procedure = 1,
                     .step = procedure_.progress().step,
                     .phase = MarkerPhase::end,
                     .rotary_angles_rad = {},
                     .tool = 0,
                     .nominal_speed_mm_s = 5,
                     .at_rest = true,
                     .at = monoTime(0)},
                    kLocked);
  }
  void edge(Level level, std::int64_t at_ms) {
    procedure_.push(Edge{LineRole::trigger, 1, level, 1, monoTime(1'000'000 * at_ms)});
  }
  void latch() {
    for (std::int64_t ms = 0; ms < 10; ++ms) {
      for (const auto axis : {Axis::x, Axis::y, Axis::z})
        procedure_.push(Count{axis, 1, 0, monoTime(1'000'000 * ms)}, 0);
    }
  }
  const Progress& progress() const { return procedure_.progress(); }
  const capture::Touch& touch() const { return procedure_.recording().touches().back(); }

  static constexpr TickMap kLocked{
      .tick = {}, .at = {}, .period_q32_ns = {}, .sigma_ns = 0, .state = ClockState::locked};
  Procedure procedure_{liveMethods(), capture::Capacity{}};
};

TEST_F(SetterRun, BeginsWithTheProbeAndGoesOnWithTheTool) {
  begin(7);
  EXPECT_EQ(progress().last_fault, capture::TouchFault::wrong_tool) << "the tool is not the probe";
  for (int step = 0; step < 18; ++step) {
    begin(1);
    latch(), edge(Level::active, 3), edge(Level::inactive, 6), end();
  }
  ASSERT_EQ(progress().step, 18U);
  begin(1);
  EXPECT_EQ(progress().last_fault, capture::TouchFault::wrong_tool) << "the probe is not the tool";
  EXPECT_EQ(progress().state, State::waiting);
  begin(7);
  EXPECT_EQ(progress().state, State::running);
}

TEST_F(SetterRun, TakesTheFirstContactAndTheLastReleaseOfAChatteringSwitch) {
  edge(Level::active, 1);  // before the step
  begin(1);
  latch();
  for (const int at : {3, 4}) edge(Level::active, at), edge(Level::inactive, at);
  edge(Level::active, 7);
  edge(Level::inactive, 8);
  end();
  ASSERT_EQ(progress().step, 1U) << "no deflections are needed";
  EXPECT_EQ(touch().contact, monoTime(3'000'000));
  EXPECT_EQ(touch().release, monoTime(8'000'000));
}

TEST_F(SetterRun, AsksAgainWithoutBothEdges) {
  begin(1);
  latch(), edge(Level::active, 3), end();
  EXPECT_EQ(progress().last_fault, capture::TouchFault::no_edges) << "the switch stayed closed";
  begin(1);
  latch(), edge(Level::inactive, 3), edge(Level::active, 5), end();
  EXPECT_EQ(progress().last_fault, capture::TouchFault::no_edges) << "it was closed before the touch";
  begin(1);
  latch(), edge(Level::active, 3), edge(Level::inactive, 6);
  procedure_.push(SourceLost{Source::trigger, LossReason::overrun, 1, monoTime(0)});
  end();
  EXPECT_EQ(progress().last_fault, capture::TouchFault::source_lost);
  EXPECT_EQ(progress().step, 0U);
}

}  // namespace
}  // namespace probebox::procedure
