#include "firmware/procedure/dataset/hold_readings.hpp"

#include <array>
#include <gtest/gtest.h>
#include <string_view>

#include "firmware/procedure/methods/methods.hpp"

// What a case says of the holds of a run.
namespace probebox::procedure {
namespace {

constexpr std::array<double, 3> kAt_mm{120.25, -80.5, -150.75}, kSensors_mm{0.125, -0.25, 0.375};

TEST(HoldReadings, AreInTheColumnsOfTheirNames) {
  capture::Recording recording{capture::Capacity{}};
  const capture::Scales scales{.mm_per_count = {1e-6, 1e-6, 1e-6}, .nominal_period = Nanoseconds{1'000'000}};
  capture::Touch touch;
  touch.request.step = 3;
  touch.request.reading = 2;
  touch.request.ball = 4;
  touch.request.tool = 5;
  touch.request.holds = true;
  touch.request.rotary_angles_rad = {0.1, 0.2, 0.3};
  touch.machine_begin = recording.machineRowCount();
  touch.probe_begin = recording.probeRowCount();
  const auto inCounts = [](double mm, int row) {
    return static_cast<std::int64_t>(1e6 * mm) + (row % 2 == 0 ? 1 : -1);
  };
  for (int row = 0; row < 20; ++row) {
    const auto at = monoTime(row * 1'000'000);
    ASSERT_TRUE(recording.append(
        capture::MachineRow{.at = at,
                            .counts = {inCounts(kAt_mm[0], row), inCounts(kAt_mm[1], row), inCounts(kAt_mm[2], row)},
                            .screw_nm = {}}));
    ASSERT_TRUE(
        recording.append(capture::ProbeRow{.at = at,
                                           .channels_nm = {static_cast<std::int32_t>(inCounts(kSensors_mm[0], row)),
                                                           static_cast<std::int32_t>(inCounts(kSensors_mm[1], row)),
                                                           static_cast<std::int32_t>(inCounts(kSensors_mm[2], row))}}));
  }
  touch.machine_end = recording.machineRowCount();
  touch.probe_end = recording.probeRowCount();
  ASSERT_TRUE(recording.append(touch));

  const auto held = holdDataset({kSensorHeadCalibration, recording, scales, Facts{}});
  const auto* holds = held.run.dataset.table("holds");
  ASSERT_NE(holds, nullptr);
  ASSERT_EQ(holds->rows(), 1U);
  const auto of = [&](std::string_view column) { return holds->column(column)->front(); };
  EXPECT_EQ(of("touch"), 3);
  EXPECT_EQ(of("reading"), 2);
  EXPECT_EQ(of("ball"), 4);
  EXPECT_EQ(of("tool"), 5);
  EXPECT_EQ(of("A_rad"), 0.1);
  EXPECT_EQ(of("B_rad"), 0.2);
  EXPECT_EQ(of("C_rad"), 0.3);
  EXPECT_NEAR(of("x_mm"), kAt_mm[0], 1e-9);
  EXPECT_NEAR(of("y_mm"), kAt_mm[1], 1e-9);
  EXPECT_NEAR(of("z_mm"), kAt_mm[2], 1e-9);
  EXPECT_NEAR(of("s1"), kSensors_mm[0], 1e-9);
  EXPECT_NEAR(of("s2"), kSensors_mm[1], 1e-9);
  EXPECT_NEAR(of("s3"), kSensors_mm[2], 1e-9);
}

}  // namespace
}  // namespace probebox::procedure
