#include "firmware/procedure/methods/sweep.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <string>

#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/procedure.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "locked_clock.hpp"

namespace probebox::procedure {
namespace {

class Sweeping : public testing::Test {
 protected:
  Sweeping() {
    procedure.start({.run = 1,
                     .method = kScrewCalibration.number,
                     .at = {},
                     .options = {.speed_count = 1, .speeds_mm_s = {0.5}, .axis = 2, .travel_mm = 40}});
  }
  // The axis Y moves by a nanometre a count, 1 um a millisecond; its sensor is read every 50 ms, Z's as well, and
  // between two positions that are kept.
  void pass(int milliseconds) {
    for (int i = 0; i < milliseconds; ++i, ++now_ms) {
      const auto at = monoTime(now_ms * 1'000'000);
      for (const Axis axis : {Axis::x, Axis::y, Axis::z})
        procedure.push(Count{.axis = axis, .sequence = 0, .counts = axis == Axis::y ? now_ms * 1000 : 0, .at = at});
      procedure.push(Deflection{.sequence = 0, .channels_nm = {}, .clipped = true, .at = at});
      if (now_ms % 50 != 3) continue;
      for (const Axis axis : {Axis::y, Axis::z})
        procedure.push(Drift{axis, axis == Axis::y ? static_cast<std::int32_t>(now_ms) : -1, at});
    }
  }
  void mark(MarkerPhase phase) {
    procedure.mark(Marker{.procedure = 1, .step = 0, .phase = phase, .at = monoTime(now_ms * 1'000'000)}, kLocked);
  }
  static Facts facts() {
    Facts facts;
    ScrewFacts screw{{.length_mm = 640, .offset_mm = 140, .pitch_mm = 10, .reversed = true}};
    screw.gain = 0.9;
    screw.sector_zero_mm = 2.5;
    screw.threshold_rpm = 60;
    facts.screws[1] = screw;
    return facts;
  }

  Procedure procedure{liveMethods(), capture::Capacity{}};
  std::int64_t now_ms{};
};

TEST_F(Sweeping, GivesReadingsOfThatScrewOverItsAngle) {
  mark(MarkerPhase::begin);
  pass(2000);
  mark(MarkerPhase::end);
  ASSERT_EQ(procedure.progress().state, State::solving) << "a clipped probe does not matter";
  const capture::Scales scales{.mm_per_count = {1e-6, 1e-6, 1e-6}, .nominal_period = Nanoseconds{1'000'000}};
  const auto [dataset, refusal, warnings] = runDataset(kScrewCalibration, procedure.recording(), scales, facts());
  EXPECT_FALSE(refusal);
  EXPECT_TRUE(warnings.empty());
  EXPECT_EQ(dataset.method, "screw-calibration");
  EXPECT_EQ(std::get<std::string>(dataset.config.at("axis")), "Y");
  EXPECT_EQ(std::get<double>(dataset.config.at("K")), 0.9);
  EXPECT_TRUE(std::get<bool>(dataset.config.at("axis_reversed")));
  ASSERT_EQ(dataset.tables.size(), 1U) << "no gain_cal";
  const auto& face = dataset.tables[0];
  ASSERT_GE(face.rows(), 38U);
  for (std::size_t k = 0; k < face.rows(); ++k) {
    const double reading_um = face.column("sensor_um")->at(k), at_s = reading_um;  // a nanometre a millisecond
    EXPECT_NEAR(face.column("t_s")->at(k) - face.column("t_s")->at(0), at_s - face.column("sensor_um")->at(0), 1e-9);
    // 1 mm/s from 0, a turn is 10 mm, sector 0 begins at 2.5 mm.
    EXPECT_NEAR(face.column("phi_rad")->at(k), 2 * std::numbers::pi * (at_s - 2.5) / 10, 1e-9);
  }
}

// The encoders begin late: 300 ms of readings, at 0, 50, ... 250 ms, have no position before them.
TEST_F(Sweeping, SaysHowManyReadingsHaveNoPosition) {
  mark(MarkerPhase::begin);
  for (; now_ms < 300; ++now_ms) {
    if (now_ms % 50 == 0) procedure.push(Drift{Axis::y, 0, monoTime(now_ms * 1'000'000)});
  }
  pass(1000);
  mark(MarkerPhase::end);
  const capture::Scales scales{.mm_per_count = {1e-6, 1e-6, 1e-6}, .nominal_period = Nanoseconds{1'000'000}};
  const auto run = runDataset(kScrewCalibration, procedure.recording(), scales, facts());
  ASSERT_EQ(run.warnings.size(), 1U);
  EXPECT_THAT(run.warnings[0], testing::StartsWith("6 of 26 readings"));
  EXPECT_EQ(run.dataset.tables[0].rows(), 20U);
}

TEST_F(Sweeping, KeepsFewPositionsSoThatMinutesFit) {
  mark(MarkerPhase::begin);
  pass(2000);
  mark(MarkerPhase::end);
  EXPECT_EQ(procedure.recording().machineRowCount(), 200U);
  EXPECT_EQ(procedure.recording().probeRowCount(), 0U);
}

TEST_F(Sweeping, HasTheTimeThatItsTravelTakes) {
  mark(MarkerPhase::begin);
  procedure.advance(monoTime(179'000'000'000));
  EXPECT_EQ(procedure.progress().state, State::running) << "80 s of travel, by half more, and a minute";
  procedure.advance(monoTime(181'000'000'000));
  EXPECT_EQ(procedure.progress().state, State::waiting);
}

}  // namespace
}  // namespace probebox::procedure
