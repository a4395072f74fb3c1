// What a ball screw's model does at every reading.
#include "firmware/metrology/live/screw_model.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>
#include <rapidcheck/gtest.h>

namespace probebox::metrology {
namespace {

constexpr double kPi = std::numbers::pi;

ScrewModel worked() {
  ScrewModel screw;
  screw.length_mm = 820.0;
  screw.offset_mm = 60.0;
  screw.gain = -0.97;
  return screw;
}

ScrewModel withTable() {
  ScrewModel screw = worked();
  const std::array<double, 8> sectors{3.240705,  2.728851,  -0.295953, -2.698666,
                                      -2.606112, -1.435657, -0.338641, 1.405473};
  std::ranges::copy(sectors, screw.sector_um.begin());
  screw.sector_count = sectors.size();
  screw.threshold_rpm = 64.0;
  return screw;
}

TEST(Screw, CompensatesAsInTheWorkedExample) {
  EXPECT_NEAR(compensationUm(worked(), 350.0, 56.58), -27.441300, 1e-9);
}

// The other way about: the same screw, with the axis counting towards the fixed bearing from a zero at its far end.
TEST(Screw, GivesTheSameShiftOfTheNutWhicheverWayTheAxisCounts) {
  ScrewModel reversed = worked();
  reversed.reversed = true;
  reversed.offset_mm = 700.0;
  for (const double distance : {10.0, 350.0, 690.0}) {
    EXPECT_NEAR(compensationUm(worked(), distance - 60.0, 40.0), -compensationUm(reversed, 700.0 - distance, 40.0),
                1e-12);
  }
}

TEST(Screw, FindsTheSectorOfTheWorkedExample) {
  EXPECT_EQ(sectorAt(200.0 * kPi / 180.0, 8), 4U);
  EXPECT_DOUBLE_EQ(faceErrorUm(worked(), 1.0), 0.0) << "without a table";
}

// Sector 4 of 8 has its middle at 202.5 degrees.
TEST(Screw, TakesTheFaceOnTheLineBetweenTheMiddlesOfSectors) {
  const auto at = [](double deg) { return faceErrorUm(withTable(), deg * kPi / 180.0); };
  EXPECT_NEAR(at(202.5), -2.606112, 1e-12);
  EXPECT_NEAR(at(200.0), -2.606112 + 2.5 / 45.0 * (-2.698666 + 2.606112), 1e-12);
  EXPECT_NEAR(at(0.0), (1.405473 + 3.240705) / 2, 1e-12) << "between the last and the first";
  EXPECT_NEAR(at(360.0), at(0.0), 1e-12);
  EXPECT_NEAR(at(22.5 - 720.0), 3.240705, 1e-12);
}

// Constant sectors would leave up to pi/24 (3 + 2 x 0.8) = 0.60 um.
TEST(Screw, FollowsTheFaceOfTheWorkedExampleWithinATenthOfAMicrometre) {
  const auto face = [](double angle) { return 3.0 * std::cos(angle - 0.4) + 0.8 * std::cos(2 * angle - 1.9); };
  ScrewModel screw = worked();
  screw.sector_count = 24;
  for (std::size_t i = 0; i < screw.sector_count; ++i) {
    constexpr int kParts = 1000;
    for (int k = 0; k < kParts; ++k)
      screw.sector_um[i] += face(2 * kPi / 24 * (static_cast<double>(i) + (k + 0.5) / kParts)) / kParts;
  }
  for (double angle = -10.0; angle < 10.0; angle += 0.01)
    EXPECT_NEAR(faceErrorUm(screw, angle), face(angle), 0.07) << angle;
}

RC_GTEST_PROP(Screw, SectorsTileTheTurn, ()) {
  const auto count = *rc::gen::inRange<std::size_t>(1, kMostSectors + 1);
  const auto sector = *rc::gen::inRange<std::size_t>(0, count);
  const auto turns = *rc::gen::inRange(-50, 50);
  const double inside = *rc::gen::inRange(1, 999) / 1000.0;
  const double angle = 2.0 * kPi * ((static_cast<double>(sector) + inside) / static_cast<double>(count) + turns);
  RC_ASSERT(sectorAt(angle, count) == sector);
}

TEST(Screw, KeepsAngleAtTheVeryEndOfATurnInsideTheTable) {
  for (const double angle : {-1e-18, 2.0 * kPi, std::nextafter(2.0 * kPi, 0.0), -2.0 * kPi, 1e300}) {
    EXPECT_LT(sectorAt(angle, 24), 24U);
  }
}

TEST(Screw, LeavesTheTableOutFromTheThresholdOn) {
  const ScrewModel screw = withTable();
  const double angle = 200.0 * kPi / 180.0;
  EXPECT_DOUBLE_EQ(extensionUm(screw, angle, 63.9, 50.0), 50.0 - faceErrorUm(screw, angle));
  EXPECT_DOUBLE_EQ(extensionUm(screw, angle, -63.9, 50.0), 50.0 - faceErrorUm(screw, angle));
  EXPECT_DOUBLE_EQ(extensionUm(screw, angle, 64.0, 50.0), 50.0);
  EXPECT_DOUBLE_EQ(extensionUm(screw, angle, -3000.0, 50.0), 50.0);
}

TEST(Screw, ThresholdIsWhereRawAndCorrectedErrAlike) {
  const double threshold = thresholdRpm(1, 0.15);
  EXPECT_NEAR(threshold, 64.0, 0.5);
  // A first-order sensor at that speed: |lag(w)| against |lag(w) - w|, worked out with the response of the filter.
  const double omega = threshold / 60.0 * 2.0 * kPi;
  const std::complex<double> lag = 1.0 / std::complex<double>{1.0, omega * 0.15};
  EXPECT_NEAR(std::abs(lag), std::abs(lag - 1.0), 1e-12);
}

RC_GTEST_PROP(TableShare, NeverJumps, ()) {
  TableShare share;
  double speed = *rc::gen::inRange(0, 200);
  double before = share.at(speed, 64.0);
  for (int k = 0; k < 100; ++k) {
    const double step = *rc::gen::inRange(-100, 100) / 100.0;
    speed += step;
    const double now = share.at(speed, 64.0);
    RC_ASSERT(now >= 0.0 && now <= 1.0);
    RC_ASSERT(std::abs(now - before) <= std::abs(step) / 12.8 + 1e-12);
    before = now;
  }
}

TEST(TableShare, SaysInUseWithHysteresis) {
  TableShare share;
  share.at(60.0, 64.0);
  EXPECT_TRUE(share.inUse());
  share.at(70.0, 64.0);
  EXPECT_TRUE(share.inUse()) << "inside the band nothing turns";
  share.at(71.0, 64.0);
  EXPECT_FALSE(share.inUse());
  share.at(60.0, 64.0);
  EXPECT_FALSE(share.inUse()) << "inside the band nothing turns";
  share.at(57.0, 64.0);
  EXPECT_TRUE(share.inUse());
}

constexpr ScrewLimits kLimits{.least_extension_um = -20.0, .greatest_extension_um = 120.0, .rate_um_s = 0.0};

TEST(ScrewCompensator, HoldsTheLastValueWhileTheSensorIsSilentOrImpossible) {
  ScrewCompensator compensator{worked(), kLimits};
  EXPECT_TRUE(compensator.step({350.0, 0.0, 0.0, std::nullopt}, 0.0).held);
  const auto good = compensator.step({350.0, 0.0, 0.0, 56.58}, 0.001);
  EXPECT_FALSE(good.held);
  EXPECT_NEAR(good.compensation_um, -27.4413, 1e-9);
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
  for (const ScrewReading& bad : {ScrewReading{100.0, 0.0, 0.0, std::nullopt}, ScrewReading{100.0, 0.0, 0.0, 500.0},
                                  ScrewReading{100.0, 0.0, 0.0, -21.0}, ScrewReading{100.0, 0.0, 0.0, kNan},
                                  ScrewReading{kNan, 0.0, 0.0, 50.0}, ScrewReading{100.0, kNan, 0.0, 50.0}}) {
    const auto held = compensator.step(bad, 0.001);
    EXPECT_TRUE(held.held);
    EXPECT_DOUBLE_EQ(held.compensation_um, good.compensation_um);
  }
  EXPECT_NEAR(compensator.step({100.0, 0.0, 0.0, 56.58}, 0.001).compensation_um, -0.97 * 160.0 / 820.0 * 56.58, 1e-9);
}

TEST(ScrewCompensator, FollowsItsReadingsNoFasterThanItsRate) {
  ScrewLimits limits = kLimits;
  limits.rate_um_s = 10.0;
  ScrewCompensator compensator{worked(), limits};
  compensator.step({350.0, 0.0, 0.0, 56.58}, 0.0);
  const auto limited = compensator.step({350.0, 0.0, 0.0, 0.0}, 0.1);
  EXPECT_TRUE(limited.rate_limited);
  EXPECT_NEAR(limited.compensation_um, -0.97 * 410.0 / 820.0 * 55.58, 1e-9);
  EXPECT_FALSE(compensator.step({350.0, 0.0, 0.0, 0.0}, 6.0).rate_limited);
}

TEST(ScrewCompensator, FollowsThePositionAtOnce) {
  ScrewLimits limits = kLimits;
  limits.rate_um_s = 5.0;
  ScrewCompensator compensator{worked(), limits};
  compensator.step({350.0, 0.0, 0.0, 56.58}, 0.0);
  const auto elsewhere = compensator.step({50.0, 0.0, 0.0, 56.58}, 0.001);
  EXPECT_NEAR(elsewhere.compensation_um, -0.97 * 110.0 / 820.0 * 56.58, 1e-9);
  EXPECT_FALSE(elsewhere.rate_limited);
}

TEST(ScrewCompensator, TakesTheTableWhileSlowAndAllowsForTheColdReading) {
  ScrewModel screw = withTable();
  screw.reference_um = 5.0;
  ScrewCompensator compensator{screw, kLimits};
  const double angle = 200.0 * kPi / 180.0;
  const double slow = compensator.step({350.0, angle, 5.0, 45.0}, 0.0).compensation_um;
  const double fast = compensator.step({350.0, angle, 500.0, 45.0}, 0.1).compensation_um;
  EXPECT_NEAR(slow, -0.97 * 0.5 * (40.0 - faceErrorUm(screw, angle)), 1e-9);
  EXPECT_NEAR(fast, -0.97 * 0.5 * 40.0, 1e-9);
}

}  // namespace
}  // namespace probebox::metrology
