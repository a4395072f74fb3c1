#include "firmware/modbus/register_image.hpp"

#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <limits>
#include <rapidcheck/gtest.h>
#include <utility>
#include <vector>

namespace probebox::modbus {
namespace {

double shown(const RegisterImage& image, std::size_t address) {
  return decode(*find(static_cast<std::uint16_t>(address)), WordOrder::high_first, image.registers());
}

RegisterImage imageOf(const published::Snapshot& snapshot) {
  RegisterImage image;
  image.fill(snapshot, {}, nullptr, WordOrder::high_first);
  return image;
}

// Whole nanometres, well beyond the limit on both sides.
rc::Gen<double> anyCorrection() {
  return rc::gen::map(rc::gen::inRange<std::int64_t>(-20'000'000, 20'000'001),
                      [](std::int64_t nm) { return static_cast<double>(nm) * 1e-6; });
}

RC_GTEST_PROP(RegisterImage, SaysTheSameInAllFormatsToTheirResolutionAndNeverWraps, ()) {
  published::Snapshot snapshot;
  snapshot.valid = true;
  bool beyond = false;
  for (auto& correction : snapshot.correction_mm) {
    correction = *anyCorrection();
    beyond = beyond || std::abs(correction) > 3.2767;
  }
  const auto image = imageOf(snapshot);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double wanted = std::fmax(-3.2767, std::fmin(3.2767, snapshot.correction_mm[axis]));
    RC_ASSERT(std::abs(shown(image, address::correction_i16 + axis) * 1e-3 - wanted) <= 0.5001e-4);
    RC_ASSERT(shown(image, address::correction_offset + axis) == shown(image, address::correction_i16 + axis));
    RC_ASSERT(std::abs(shown(image, address::correction_f32 + 2 * axis) - wanted) <= 2e-7);
    RC_ASSERT(std::abs(shown(image, address::correction_i32 + 2 * axis) * 1e-6 - wanted) <= 0.5001e-6);
  }
  RC_ASSERT((image[address::status] & published::kValid) != 0);
  RC_ASSERT(((image[address::status] & published::kDegraded) != 0) == beyond);
}

TEST(RegisterImage, HoldsTheServedValueAndDropsValidWhenACorrectionIsNotANumber) {
  RegisterImage image;
  published::Snapshot snapshot;
  snapshot.valid = true;
  snapshot.correction_mm = {0.1, -0.2, 0.3};
  image.fill(snapshot, {}, nullptr, WordOrder::high_first);
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), HUGE_VAL, -HUGE_VAL}) {
    snapshot.correction_mm[1] = bad;
    image.fill(snapshot, {}, nullptr, WordOrder::high_first);
    EXPECT_EQ(image[6], 65536 - 2000);
    EXPECT_EQ(image[address::status], published::kDegraded);
  }
}

TEST(RegisterImage, ShowsEachStatusBitInItsPlace) {
  published::Snapshot none;
  EXPECT_EQ(imageOf(none)[address::status], 0);
  const std::vector<std::pair<published::Status, std::function<void(published::Snapshot&)>>> bits{
      {published::Status{1}, [](auto& s) { s.valid = true; }},
      {published::Status{2}, [](auto& s) { s.clock_locked = true; }},
      {published::Status{4}, [](auto& s) { s.delay.calibrated = true; }},
      {published::Status{8}, [](auto& s) { s.centreline_calibrated = true; }},
      {published::Status{16}, [](auto& s) { s.screw_sensors_good = true; }},
      {published::Status{32}, [](auto& s) { s.degraded = true; }},
      {published::Status{64}, [](auto& s) { s.loss_seen = true; }},
      {published::Status{128}, [](auto& s) { s.referenced = true; }},
  };
  for (const auto& [bit, set] : bits) {
    published::Snapshot snapshot;
    set(snapshot);
    EXPECT_EQ(imageOf(snapshot)[address::status], bit);
  }
}

TEST(RegisterImage, SaturatesTheAgeAndWrapsTheCounters) {
  published::Snapshot snapshot;
  snapshot.age_ms = 6'553'400;
  EXPECT_EQ(imageOf(snapshot)[11], 65534);
  snapshot.age_ms = std::numeric_limits<std::uint64_t>::max();
  EXPECT_EQ(imageOf(snapshot)[11], 65535);
  snapshot.ledger.produced = (std::uint64_t{5} << 32) + 7;
  EXPECT_EQ(shown(imageOf(snapshot), address::samples_produced), 7);
}

TEST(RegisterImage, ShowsTheDelayInForceInBothUnitsAndNoneWithoutOne) {
  published::Snapshot snapshot;
  snapshot.delay = {true, 12, {0.0052, -0.001, 0.00385}, {3e-6, 4e-6, 5e-6}};
  const auto image = imageOf(snapshot);
  EXPECT_NEAR(shown(image, 64), 5.2, 1e-6);
  EXPECT_NEAR(shown(image, 66), -1.0, 1e-6);
  EXPECT_NEAR(shown(image, 72), 0.004, 1e-9);
  EXPECT_EQ(shown(image, 80), 5'200'000);
  EXPECT_EQ(shown(image, 82), -1'000'000);
  EXPECT_EQ(shown(image, 90), 5000);
  EXPECT_EQ(shown(image, address::delay_result), 12);
  snapshot.delay = {false, 12, {0.0052, 0, 0}, {3e-6, 0, 0}};
  EXPECT_NEAR(shown(imageOf(snapshot), 64), 5.2, 1e-6) << "of X alone";
  EXPECT_EQ(shown(imageOf(snapshot), 66), 0);
  EXPECT_EQ(shown(imageOf(snapshot), 72), 0) << "no sd: it was never measured";
  snapshot.delay.result_id = 0;
  EXPECT_EQ(shown(imageOf(snapshot), 64), 0);
}

TEST(RegisterImage, ShowsTheErrorsOfRotaryAxesAtThePresentAngleAndWhatTheHeadAdds) {
  published::Snapshot snapshot;
  auto& c = snapshot.rotary[2];
  c = {.described = true,
       .known = true,
       .doubtful = true,
       .angle_rad = 1.5707963267948966,
       .last_fault = {},
       .reference_losses = 0,
       .result_id = 70'000,
       .has_errors = true,
       .errors = {0.001, 0.002, -0.003, 1e-5, 2e-5, -3e-5},
       .sd_errors = {1e-4, 2e-4, 3e-4, 1e-6, 2e-6, 3e-6}};
  snapshot.swivel = {
      .result_id = 4, .error_mm = {0.01, 0, -0.02}, .tool = 7, .has_tool_length = true, .tool_length_mm = 120.5};
  const auto image = imageOf(snapshot);
  EXPECT_EQ(shown(image, 256), 0b100);
  EXPECT_EQ(shown(image, 257), 0b100);
  EXPECT_NEAR(shown(image, 262), 90, 1e-5);
  EXPECT_EQ(shown(image, 276), 0b100);
  EXPECT_EQ(shown(image, 282), 70'000);
  EXPECT_NEAR(shown(image, 312), 0.001, 1e-9) << "deviation XC";
  EXPECT_NEAR(shown(image, 316), -0.003, 1e-9);
  EXPECT_NEAR(shown(image, 322), -3e-5, 1e-11);
  EXPECT_NEAR(shown(image, 348), 1e-4, 1e-10) << "deviation XC, sd";
  EXPECT_NEAR(shown(image, 358), 3e-6, 1e-12);
  EXPECT_EQ(shown(image, 288), 0) << "deviation XA: nothing is known of A";
  EXPECT_EQ(shown(image, 264), 7);
  EXPECT_NEAR(shown(image, 266), 120.5, 1e-4);
  EXPECT_EQ(shown(image, 268), 4);
  EXPECT_NEAR(shown(image, 274), -0.02, 1e-8);
  c.has_errors = false;
  EXPECT_EQ(shown(imageOf(snapshot), 312), 0);
}

}  // namespace
}  // namespace probebox::modbus
