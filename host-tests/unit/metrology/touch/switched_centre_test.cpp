#include "firmware/metrology/touch/switched_centre.hpp"

#include <array>
#include <gtest/gtest.h>
#include <random>

#include "host-tests/metrology/moments.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;

constexpr std::array<std::array<double, 3>, 5> kSides{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}}};
constexpr double kApproach_mm_s = 40, kBall_mm = 15;

struct SwitchedRun {
  std::vector<SwitchedTouch> touches;
  std::vector<std::size_t> reading;
};

// Five readings of one ball. Each edge is stamped later or earlier by the jitter, of which the position of a touch
// keeps half the difference and its lateness half the sum.
SwitchedRun touchedWith(double jitter_s, double switch_sd_mm, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  SwitchedRun run;
  for (std::size_t reading = 0; reading < 5; ++reading) {
    for (const auto& side : kSides) {
      const double in_s = jitter_s * normal(random), out_s = jitter_s * normal(random);
      const double in_mm = switch_sd_mm * normal(random), out_mm = switch_sd_mm * normal(random);
      const double off_mm = (kApproach_mm_s * (out_s - in_s) - in_mm - out_mm) / 2;
      const Vector3d n{side.data()};
      run.touches.push_back({.normal = n,
                             .at_mm = (kBall_mm + off_mm) * n,
                             .sd_mm = 1e-6,
                             .speed_mm_s = kApproach_mm_s,
                             .late_s = 5e-4 + (in_s + out_s) / 2 + (in_mm - out_mm) / (2 * kApproach_mm_s)});
      run.reading.push_back(reading);
    }
  }
  return run;
}

Moments errorsWith(double jitter_s, double switch_sd_mm) {
  std::mt19937_64 random{7};
  Moments errors;
  for (int run = 0; run < 100; ++run) {
    const auto [touches, reading] = touchedWith(jitter_s, switch_sd_mm, random);
    const auto centres = switchedCentres(touches, reading, switch_sd_mm);
    EXPECT_TRUE(centres);
    for (const auto& ball : centres->readings)
      for (Eigen::Index axis = 0; axis < 3; ++axis) errors.add(ball.centre_mm[axis], ball.sd_mm[axis]);
  }
  return errors;
}

// Jitter of 10 us at 40 mm/s is 0.28 um of a touch, as much again as a switch that repeats to 0.4 um.
TEST(SwitchedCentres, HaveTheJitterOfTheStampsInTheirUncertainty) {
  const auto errors = errorsWith(1e-5, 4e-4);
  EXPECT_GT(errors.pull(), 0.8);
  EXPECT_LT(errors.pull(), 1.1) << "2.0 without the jitter";
}

TEST(SwitchedCentres, AreAsGoodAsTheirSwitchWhereStampsAreExact) {
  const auto errors = errorsWith(0, 4e-4);
  EXPECT_GT(errors.pull(), 0.75) << "the scatter of few edges widens a little";
  EXPECT_LT(errors.pull(), 1.1);
}

}  // namespace
}  // namespace probebox::metrology
