// Runs that measure the probe itself: its gain and its lobes turn with A and with a swivelling head.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/procedure.hpp"
#include "firmware/procedure/plan/prompts.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "obedient_machine.hpp"

namespace probebox::procedure {
namespace {

using testing::HasSubstr;

constexpr std::array kOfTheProbe{&kDelayMultiSpeed, &kDelayKnownSphere, &kDelayPerAxis, &kDelayNonNormal, &kDelayPlates,
                                 &kDelayInOut,      &kDelaySteppedScan, &kDelayContour, &kSelftest,       &kPreTravel};

TEST(RunsThatMeasureTheProbe, AskForItsPoseInEveryStepThatTouches) {
  for (const LiveMethod* method : kOfTheProbe) {
    const auto plan = std::make_unique<Plan>();
    fill(*plan, *method, {.reach_mm = 15.5});
    ASSERT_GT(plan->step_count, 0U);
    for (std::size_t i = 0; i < plan->step_count; ++i) {
      const Step& step = plan->steps[i];
      if (step.kind == Kind::jog) continue;
      EXPECT_TRUE(step.turns) << method->name();
      EXPECT_EQ(step.touch.rotary_angles_rad, (std::array<double, 3>{})) << method->name();
      EXPECT_THAT(promptFor(*plan, i), HasSubstr("0 deg")) << method->name();
    }
  }
}

TEST(RunsThatMeasureTheProbe, DoNotBeginWithATurnedSpindleOrHead) {
  for (const std::size_t axis : {0U, 1U}) {
    Procedure procedure{liveMethods(), capture::Capacity{}};
    ObedientMachine machine{procedure};
    procedure.start({.run = 1, .method = kDelayKnownSphere.number, .at = {}, .options = {}});
    machine.angles_rad[axis] = 3 * kTurn_rad / 4;
    machine.mark(MarkerPhase::begin);
    EXPECT_EQ(procedure.progress().state, State::waiting);
    EXPECT_EQ(procedure.progress().last_fault, capture::TouchFault::wrong_pose);
  }
}

TEST(RunsThatMeasureTheProbe, KeepTheReportedPoseInTheirCase) {
  Procedure procedure{liveMethods(), capture::Capacity{}};
  ObedientMachine machine{procedure};
  procedure.start({.run = 1, .method = kDelayKnownSphere.number, .at = {}, .options = {}});
  machine.angles_rad = {kTurn_rad + 1.5e-3, -1e-3, 0};
  while (procedure.progress().state == State::waiting) machine.touch();
  const auto& config = runDataset(kDelayKnownSphere, procedure.recording(), {}, {}).dataset.config;
  EXPECT_NEAR(std::get<double>(config.at("A_rad")), 1.5e-3, 1e-12) << "whole turns aside";
  EXPECT_NEAR(std::get<double>(config.at("B_rad")), -1e-3, 1e-12);
}

}  // namespace
}  // namespace probebox::procedure
