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

template <std::size_t kPoints, class Interpolate>
double worstError(Interpolate&& interpolate) {
  double worst = 0;
  for (std::int64_t start = 0; start < 200; ++start) {
    std::array<MonoTime, kPoints> at;
    std::array<std::int64_t, kPoints> values;
    for (std::size_t i = 0; i < kPoints; ++i) {
      at[i] = monoTime((start + static_cast<std::int64_t>(i)) * kIntervalNs);
      values[i] = std::llround(Sine::at(toSeconds(at[i].time_since_epoch())));
    }
    const std::size_t before = kPoints / 2 - 1;
    for (const std::int64_t part : {0, 100'000, 500'000, 777'777}) {
      const MonoTime t = at[before] + Nanoseconds{part};
      const auto got = static_cast<double>(interpolate(t, at, values));
      worst = std::max(worst, std::abs(got - Sine::at(toSeconds(t.time_since_epoch()))));
    }
  }
  return worst;
}

constexpr double kRounding = 1.5;  // nm: of the stamps and of the result

TEST(Interpolation, LinearStaysWithinItsBound) {
  const double bound = 1e-6 / 8 * Sine::kAmplitude * Sine::kOmega * Sine::kOmega;
  const double worst = worstError<2>(linear);
  EXPECT_LT(worst, bound + kRounding);
  EXPECT_GT(worst, 0.9 * bound);
}

TEST(Interpolation, CubicStaysWithinItsFarSmallerBound) {
  const double bound = 3.0 / 128 * 1e-12 * Sine::kAmplitude * std::pow(Sine::kOmega, 4);
  EXPECT_LT(worstError<4>(cubic), bound + kRounding);
}

TEST(Interpolation, LargeCountsKeepEveryDigit) {
  constexpr std::int64_t kLarge = 9'000'000'000'000'000'001;
  EXPECT_EQ(linear(monoTime(5), {monoTime(0), monoTime(10)}, {kLarge, kLarge + 10}), kLarge + 5);
  EXPECT_EQ(cubic(monoTime(15), {monoTime(0), monoTime(10), monoTime(20), monoTime(30)},
                  {kLarge, kLarge + 10, kLarge + 20, kLarge + 30}),
            kLarge + 15);
}

TEST(Interpolation, CounterMayWrapAround) {
  constexpr std::int64_t kMost = std::numeric_limits<std::int64_t>::max();
  constexpr std::int64_t kLeast = std::numeric_limits<std::int64_t>::min();
  EXPECT_EQ(linear(monoTime(5), {monoTime(0), monoTime(10)}, {kMost - 1, kLeast + 2}), kLeast);
}

}  // namespace
}  // namespace probebox::latch
