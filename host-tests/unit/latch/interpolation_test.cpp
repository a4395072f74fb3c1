#include "firmware/latch/interpolation.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <limits>
#include <numbers>

namespace probebox::latch {
namespace {

// A sine of 1 mm in nm, 5 Hz, stamped every millisecond; the largest error between stamps against the bounds of
// metrology A.9.
struct Sine {
  static constexpr double kAmplitude = 1e6;
  static constexpr double kOmega = 2 * std::numbers::pi * 5;
  static double at(double seconds) { return kAmplitude * std::sin(kOmega * seconds); }
};

constexpr std::int64_t kIntervalNs = 1'000'000;

// By that many stamps.
template <std::size_t kPoints>
double worstError() {
  double worst = 0;
  for (std::int64_t start = 0; start < 200; ++start) {
    std::array<MonoTime, kPoints> at;
    std::array<Interval<1>::Values, kPoints> values;
    for (std::size_t i = 0; i < kPoints; ++i) {
      at[i] = monoTime((start + static_cast<std::int64_t>(i)) * kIntervalNs);
      values[i][0] = std::llround(Sine::at(toSeconds(at[i].time_since_epoch())));
    }
    const std::size_t before = kPoints / 2 - 1;
    for (const std::int64_t part : {0, 100'000, 500'000, 777'777}) {
      const MonoTime t = at[before] + Nanoseconds{part};
      const auto got = static_cast<double>(Interval<1>{at, values}.at(t)[0]);
      worst = std::max(worst, std::abs(got - Sine::at(toSeconds(t.time_since_epoch()))));
    }
  }
  return worst;
}

constexpr double kRounding = 1.5;  // nm: of the stamps and of the result

TEST(Interpolation, LinearStaysWithinItsBound) {
  const double bound = 1e-6 / 8 * Sine::kAmplitude * Sine::kOmega * Sine::kOmega;
  const double worst = worstError<2>();
  EXPECT_LT(worst, bound + kRounding);
  EXPECT_GT(worst, 0.9 * bound);
}

TEST(Interpolation, CubicStaysWithinItsFarSmallerBound) {
  const double bound = 3.0 / 128 * 1e-12 * Sine::kAmplitude * std::pow(Sine::kOmega, 4);
  EXPECT_LT(worstError<4>(), bound + kRounding);
}

using Linear = std::array<Interval<1>::Values, 2>;
using Cubic = std::array<Interval<1>::Values, 4>;

TEST(Interpolation, LargeCountsKeepEveryDigit) {
  constexpr std::int64_t kLarge = 9'000'000'000'000'000'001;
  const Interval<1> linear{std::array{monoTime(0), monoTime(10)}, Linear{{{kLarge}, {kLarge + 10}}}};
  EXPECT_EQ(linear.at(monoTime(5))[0], kLarge + 5);
  const Interval<1> cubic{std::array{monoTime(0), monoTime(10), monoTime(20), monoTime(30)},
                          Cubic{{{kLarge}, {kLarge + 10}, {kLarge + 20}, {kLarge + 30}}}};
  EXPECT_EQ(cubic.at(monoTime(15))[0], kLarge + 15);
}

TEST(Interpolation, CounterMayWrapAround) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
  const Interval<1> linear{std::array{monoTime(0), monoTime(10)}, Linear{{{kMost - 1}, {kLeast + 2}}}};
  EXPECT_EQ(linear.at(monoTime(5))[0], kLeast);
}

// A polynomial of the third order is met exactly, whatever the stamps' intervals.
TEST(Interpolation, CubicMeetsACubicBetweenUnevenStamps) {
  const auto value = [](std::int64_t t) { return 7 + 3 * t - 2 * t * t + t * t * t; };
  const std::array<std::int64_t, 4> at{-13, 2, 31, 40};
  std::array<MonoTime, 4> stamps;
  Cubic values;
  for (std::size_t i = 0; i < at.size(); ++i) stamps[i] = monoTime(at[i]), values[i] = {value(at[i])};
  const Interval<1> cubic{stamps, values};
  EXPECT_FALSE(cubic.holds(monoTime(2)));
  EXPECT_FALSE(cubic.holds(monoTime(31)));
  for (std::int64_t t = 3; t < 31; ++t) {
    ASSERT_TRUE(cubic.holds(monoTime(t)));
    EXPECT_EQ(cubic.at(monoTime(t))[0], value(t));
  }
}

}  // namespace
}  // namespace probebox::latch
