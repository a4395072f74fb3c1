#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <numbers>
#include <set>

#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/procedure.hpp"
#include "firmware/procedure/plan/prompts.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "locked_clock.hpp"
#include "refusal.hpp"

// Steps at which a sensor head stands still over a ball: what is asked for, what it needs, and what is asked again.
namespace probebox::procedure {
namespace {

using capture::TouchFault;
using testing::HasSubstr;

constexpr ProcedureOptions kHead{.head_tool = 5, .head_range_mm = 0.5};

std::unique_ptr<Plan> planned(const LiveMethod& method, const ProcedureOptions& options) {
  auto plan = std::make_unique<Plan>();
  fill(*plan, method, options);
  return plan;
}

// The limit of the probe is none of the head's.
constexpr double kProbeLimit_mm = 0.01;

Facts factsWithHead() {
  Facts facts;
  facts.ball_plate = BallPlate{.axis_point_mm = {}, .sd_mm = {}, .balls_mm = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  facts.sensor_head = SensorHead{.tool = 5, .range_mm = 0.5, .centre_offset_mm = {0, 0, -30}};
  return facts;
}

TEST(HoldPlan, MovesEveryAxisAloneToEitherSideOfTheMiddle) {
  const auto plan = planned(kSensorHeadCalibration, kHead);
  ASSERT_EQ(plan->step_count, 13U);
  std::set<std::array<double, 3>> places;
  std::array<double, 3> sum{};
  for (std::size_t k = 0; k < plan->step_count; ++k) {
    const Step& step = plan->steps[k];
    EXPECT_EQ(step.kind, Kind::hold);
    EXPECT_EQ(step.feature, Feature::datum_sphere);
    EXPECT_TRUE(step.turns) << "K belongs to the head as it hangs at A = 0";
    EXPECT_TRUE(step.touch.holds);
    EXPECT_EQ(step.touch.tool, 5U);
    EXPECT_EQ(step.touch.reading, k);
    EXPECT_LE(step.touch.travel_mm, 0.2 + 1e-12) << "within the range, wherever the middle was found";
    std::array<double, 3> place{};
    for (std::size_t i = 0; i < 3; ++i) {
      place[i] = step.touch.travel_mm * step.touch.outward_normal[i];
      sum[i] += place[i];
    }
    places.insert(place);
  }
  EXPECT_EQ(places.size(), 13U);
  for (const double mean : sum) EXPECT_NEAR(mean, 0, 1e-12);
  EXPECT_THAT(promptFor(*plan, 0),
              testing::AllOf(HasSubstr("step 1"), HasSubstr("0 deg"), HasSubstr("tool 5"), HasSubstr("sphere")));
  EXPECT_THAT(promptFor(*plan, 1), testing::AllOf(HasSubstr("0.2 mm"), HasSubstr("to +X")));
  EXPECT_THAT(promptFor(*plan, 4), testing::AllOf(HasSubstr("0.2 mm"), HasSubstr("to -X")));
}

TEST(HoldPlan, ReadsAPlateWithOneHoldWhereTheProbeTouchesFiveTimes) {
  const ProcedureOptions options{.angles = 12, .balls = 3, .head_tool = 5, .head_range_mm = 0.5};
  EXPECT_EQ(refusal(kRotaryAxisErrors, options, kProbeLimit_mm), "") << "the probe would need 195 touches";
  const auto plan = planned(kRotaryAxisErrors, options);
  ASSERT_EQ(plan->step_count, 13U * 3U);
  for (std::size_t k = 0; k < plan->step_count; ++k) {
    const auto& touch = plan->steps[k].touch;
    EXPECT_EQ(plan->steps[k].kind, Kind::hold);
    EXPECT_EQ(touch.travel_mm, 0);
    EXPECT_EQ(touch.ball, k % 3 + 1);
    EXPECT_EQ(touch.reading, k);
    const double stop = k / 3 < 12 ? static_cast<double>(k / 3) : 0;
    EXPECT_NEAR(touch.rotary_angles_rad[2], stop * std::numbers::pi / 6, 1e-12);
  }
  EXPECT_THAT(promptFor(*plan, 4), testing::AllOf(HasSubstr("30 deg"), HasSubstr("tool 5"), HasSubstr("ball 2")));
}

TEST(HoldPlan, RefusesWhatAHeadCannotUse) {
  EXPECT_THAT(refusal(kSensorHeadCalibration, {}, kProbeLimit_mm),
              testing::AllOf(HasSubstr("[sensor_head]"), HasSubstr("range_mm")));
  EXPECT_EQ(refusal(kSensorHeadCalibration, kHead, kProbeLimit_mm), "");
  auto touching = kHead;
  touching.overtravel_mm = 0.3;
  EXPECT_THAT(refusal(kRotaryAxisErrors, touching, kProbeLimit_mm),
              testing::AllOf(HasSubstr("overtravel"), HasSubstr("clearance")));
  auto fast = kHead;
  fast.speed_count = 1;
  fast.speeds_mm_s[0] = 5;
  EXPECT_THAT(refusal(kRotaryAxisErrors, fast, kProbeLimit_mm), HasSubstr("no speeds"));
  EXPECT_THAT(refusal(kCentreline, kHead, kProbeLimit_mm), HasSubstr("sensor head"));
  auto many = kHead;
  many.angles = 30;
  many.balls = 7;
  EXPECT_THAT(refusal(kRotaryAxisErrors, many, kProbeLimit_mm), HasSubstr("217 holds"));
}

TEST(HoldPlan, NeedsAHeadThatIsDescribedAndCalibratedAndNoDelay) {
  Facts facts = factsWithHead();
  EXPECT_FALSE(whyUnready(kSensorHeadCalibration, facts, false)) << "nothing moves while it reads";
  EXPECT_THAT(whyUnready(kSensorHeadCalibration, {}, true)->what,
              testing::AllOf(HasSubstr("[sensor_head]"), HasSubstr("range_mm")));
  EXPECT_FALSE(whyUnready(kRotaryAxisErrors, facts, false, ReadBy::head));
  EXPECT_TRUE(whyUnready(kRotaryAxisErrors, facts, false)) << "the probe needs one";

  EXPECT_FALSE(whyNoHead(kSensorHeadCalibration, facts));
  EXPECT_THAT(whyNoHead(kRotaryAxisErrors, facts)->what, HasSubstr("calibrate sensor-head-calibration"));
  facts.sensor_head->calibrated = CalibratedHead{};
  EXPECT_FALSE(whyNoHead(kRotaryAxisErrors, facts));
  EXPECT_THAT(whyNoHead(kRotaryAxisErrors, {})->what, HasSubstr("[sensor_head]"));
  EXPECT_THAT(whyNoHead(kCentreline, facts)->what, HasSubstr("sensor head"));

  EXPECT_EQ(described(kSensorHeadCalibration, {}, facts).value().head_tool, 5U);
  EXPECT_EQ(described(kRotaryAxisErrors, {}, facts).value().head_tool, 0U) << "the probe, unless the head is asked for";
  EXPECT_EQ(described(kRotaryAxisErrors, {}, facts, ReadBy::head).value().head_range_mm, 0.5);
}

// A box whose encoders count nanometres, at the first step.
class HoldRun : public testing::Test {
 protected:
  HoldRun() { procedure_.start({.run = 1, .method = kSensorHeadCalibration.number, .at = {}, .options = kHead}); }
  void begin(std::uint32_t tool = 5, bool at_rest = true, double a_rad = 0) {
    mark(MarkerPhase::begin, tool, at_rest, a_rad);
  }
  void end() { mark(MarkerPhase::end, 5, true, 0); }
  // Ten rows of both streams; `to_nm`: where the machine is by the end.
  void hold(std::int64_t to_nm = 0, std::int32_t channel_nm = 100'000, bool clipped = false) {
    for (std::int64_t k = 0; k < 10; ++k) {
      const MonoTime at = monoTime(1'000'000 * k);
      for (const auto axis : {Axis::x, Axis::y, Axis::z})
        procedure_.push(Count{axis, 1, axis == Axis::y ? to_nm * k / 9 : 0, at}, 0);
      procedure_.push(Deflection{.sequence = 1, .channels_nm = {0, channel_nm, 0}, .clipped = clipped, .at = at});
    }
  }
  const Progress& progress() const { return procedure_.progress(); }

 private:
  void mark(MarkerPhase phase, std::uint32_t tool, bool at_rest, double a_rad) {
    procedure_.mark({.procedure = 1,
                     .step = procedure_.progress().step,
                     .phase = phase,
                     .rotary_angles_rad = {a_rad, 0, 0},
                     .tool = tool,
                     .nominal_speed_mm_s = 15,
                     .at_rest = at_rest,
                     .at = monoTime(0)},
                    kLocked);
  }

 protected:
  Procedure procedure_{liveMethods(), capture::Capacity{}, {1e-6, -1e-6, 1e-6}};
};

TEST_F(HoldRun, TakesAMachineThatStandsStill) {
  begin(), hold(19'000), end();
  EXPECT_EQ(progress().step, 1U);
  EXPECT_EQ(progress().last_fault, TouchFault::none);
}

TEST_F(HoldRun, AsksAgainWhereTheMachineMoved) {
  begin(), hold(21'000), end();
  EXPECT_EQ(progress().step, 0U);
  EXPECT_EQ(progress().last_fault, TouchFault::moved);
  EXPECT_THAT(capture::explain(TouchFault::moved), HasSubstr("stopped"));
  begin(5, false);
  EXPECT_EQ(progress().state, State::waiting) << "it says itself that it moves";
  EXPECT_EQ(progress().last_fault, TouchFault::moved);
}

TEST_F(HoldRun, AsksAgainForABallBeyondTheRange) {
  begin(), hold(0, 100'000, true), end();
  EXPECT_EQ(progress().last_fault, TouchFault::head_out_of_range) << "the sensor says so";
  begin(), hold(0, -500'000), end();
  EXPECT_EQ(progress().last_fault, TouchFault::head_out_of_range) << "it is described so";
  EXPECT_EQ(progress().step, 0U);
  begin(), hold(0, -499'000), end();
  EXPECT_EQ(progress().step, 1U);
}

TEST_F(HoldRun, AsksForTheHeadAndForTheSpindleAtZero) {
  begin(1);
  EXPECT_EQ(progress().last_fault, TouchFault::wrong_tool) << "the probe is not the head";
  begin(5, true, 0.1);
  EXPECT_EQ(progress().last_fault, TouchFault::wrong_pose) << "its sensors would look elsewhere";
  begin();
  EXPECT_EQ(progress().state, State::running);
}

}  // namespace
}  // namespace probebox::procedure
