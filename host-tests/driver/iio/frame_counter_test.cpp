#include "drivers/iio/frame_counter.hpp"

#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace probebox::iio {
namespace {

constexpr Nanoseconds kPeriod{1'000'000};

// Stamps of frames number `taken`, of a device whose period is longer than nominal by so much.
std::vector<FrameCounter::Number> numbersOf(const std::vector<double>& periods, FrameCounter& counter, double ppm = 0) {
  std::vector<FrameCounter::Number> numbers;
  for (const double at : periods) {
    const auto stamp = monoTime(5'000'000'000 + std::llround(at * 1e6 * (1 + ppm * 1e-6)));
    if (const auto number = counter.push(stamp)) numbers.push_back(*number);
  }
  return numbers;
}

TEST(FrameCounter, CountsEveryFrameOfADeviceWhosePeriodIsNotQuiteNominal) {
  for (const double ppm : {-200.0, 200.0}) {
    FrameCounter counter{kPeriod};
    std::vector<double> periods;
    for (int i = 0; i < 100'000; ++i) periods.push_back(i);
    const auto numbers = numbersOf(periods, counter, ppm);
    ASSERT_EQ(numbers.size(), 99'999U) << "the last one waits for the next";
    EXPECT_EQ(numbers.back().counter, 99'998U);
    EXPECT_EQ(counter.missing(), 0U);
    EXPECT_FALSE(counter.wrongRateHz());
  }
}

TEST(FrameCounter, FindsEveryMissingFrameAmongLateStamps) {
  std::mt19937_64 random{7};
  FrameCounter counter{kPeriod};
  std::vector<double> stamps;
  std::vector<std::uint32_t> truth;
  double last = 0;
  bool was_late = false;
  for (std::uint32_t i = 0; i < 200'000; ++i) {
    // Dropped by the kernel; not right after a late one, because then nothing shows which of the two it was.
    if (i > 100 && !was_late && std::uniform_int_distribution{0, 99}(random) == 0) continue;
    double at = i + std::lognormal_distribution{-4.0, 0.8}(random);
    // One in a thousand is late by most of a period, and the next may not be earlier.
    was_late = std::uniform_int_distribution{0, 999}(random) == 0;
    if (was_late) at += 0.7;
    at = std::max(at, last + 1e-5);
    last = at;
    stamps.push_back(at);
    truth.push_back(i);
  }
  const auto numbers = numbersOf(stamps, counter, 60);
  ASSERT_EQ(numbers.size() + 1, truth.size());
  for (std::size_t i = 0; i < numbers.size(); ++i) ASSERT_EQ(numbers[i].counter, truth[i]) << i;
  EXPECT_EQ(counter.missing(), truth[numbers.size() - 1] + 1 - numbers.size());
  EXPECT_EQ(numbers.back().run, 0);
}

TEST(FrameCounter, BeginsAnewAfterAGapThatItCannotCount) {
  FrameCounter counter{kPeriod};
  const auto numbers = numbersOf({0, 1, 2, 1002, 1003, 4003, 4004, 4005}, counter);
  ASSERT_EQ(numbers.size(), 7U);
  EXPECT_EQ(numbers[3].counter, 1002U);
  EXPECT_EQ(numbers[3].run, 0);
  EXPECT_EQ(numbers[5].counter, 0U);
  EXPECT_EQ(numbers[5].run, 1);
  EXPECT_EQ(numbers[6].counter, 1U);
}

TEST(FrameCounter, SaysWhatTheRateIsWhenItIsNotNominal) {
  for (const double factor : {0.5, 2.0, 0.8}) {
    FrameCounter counter{kPeriod};
    std::vector<double> periods;
    for (int i = 0; i < 600; ++i) periods.push_back(i * factor);
    numbersOf(periods, counter);
    ASSERT_TRUE(counter.wrongRateHz()) << factor;
    EXPECT_NEAR(*counter.wrongRateHz(), 1000 / factor, 20) << factor;
  }
}

TEST(FrameCounter, NumbersARunFromZero) {
  FrameCounter counter{kPeriod};
  numbersOf({0, 1, 2}, counter);
  counter.startRun(9);
  const auto numbers = numbersOf({0.4, 1.4, 2.4}, counter);
  ASSERT_EQ(numbers.size(), 2U);
  EXPECT_EQ(numbers[0].run, 9);
  EXPECT_EQ(numbers[0].counter, 0U);
}

}  // namespace
}  // namespace probebox::iio
