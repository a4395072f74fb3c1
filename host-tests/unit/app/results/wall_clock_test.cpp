#include "firmware/app/results/wall_clock.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "protocol/units/calendar.hpp"

namespace probebox::app {
namespace {

using namespace std::chrono;
using ::testing::HasSubstr;

constexpr WallClock kKept{.is_kept_right = true, .start = 7}, kLeftAlone{.is_kept_right = false, .start = 7};
constexpr int kImpossible[]{1970, 2001, 2025, 2101};

sys_seconds noonIn(int year) {
  return sys_days{std::chrono::year{year} / November / 29} + hours{12};
}

io::KernelClock showing(int year) {
  return {.utc = noonIn(year)};
}

ToldTime told(int year, std::uint32_t error_ms, seconds since_start = 100s) {
  return {{.utc_us = duration_cast<microseconds>(noonIn(year).time_since_epoch()).count(), .error_ms = error_ms},
          since_start,
          "usb"};
}

TEST(WallClock, DatesOnlyWhatItCanKnow) {
  EXPECT_EQ(dateOf(showing(2026), kKept, {}, 12s).text, "2026-11-29T12:00:00Z");
  const auto left_alone = dateOf(showing(2026), kLeftAlone, {}, 12s);
  EXPECT_FALSE(left_alone.at) << "it may be the day of the image";
  EXPECT_EQ(left_alone.source, "unknown");
  for (const int year : kImpossible) EXPECT_FALSE(dateOf(showing(year), kKept, {}, 12s).at) << year;
  EXPECT_EQ(dateOf(showing(2056), kKept, {}, 12s).at, noonIn(2056));
}

TEST(WallClock, AHardwareClockWithAnEmptyBatteryDatesNothing) {
  for (const int year : kImpossible) {
    auto clock = showing(year);
    clock.from_hardware = true;
    EXPECT_FALSE(dateOf(clock, kLeftAlone, {}, 12s).at) << year;
    clock.synchronised = true;  // by a server that is wrong
    EXPECT_FALSE(dateOf(clock, kLeftAlone, {}, 12s).at) << year;
  }
}

// The hardware clock at 2001, the kernel's at the day of the image.
TEST(WallClock, AClockThatShowsSomethingElseWasNotSetFromTheHardware) {
  EXPECT_FALSE(io::isSetFrom(noonIn(2001), noonIn(2026)));
  EXPECT_FALSE(io::isSetFrom(noonIn(2101), noonIn(2026)));
  EXPECT_TRUE(io::isSetFrom(noonIn(2026), noonIn(2026) + 3s));
  EXPECT_TRUE(io::isSetFrom(noonIn(2026) + 2h, noonIn(2026))) << "local time";
}

TEST(WallClock, SaysWhereADateComesFrom) {
  auto clock = showing(2026);
  clock.from_hardware = true;
  EXPECT_THAT(dateOf(clock, kLeftAlone, {}, 12s).source, HasSubstr("hardware"));
  clock.synchronised = true;
  clock.largest_error = 12ms;
  EXPECT_THAT(dateOf(clock, kLeftAlone, {}, 12s).source, HasSubstr("0.012 s"));
}

TEST(WallClock, SaysWhenItWasOfTheStarts) {
  const auto said = dateOf(showing(1970), {.is_kept_right = true, .start = 31}, {}, 4000s).text;
  EXPECT_THAT(said, HasSubstr("4000"));
  EXPECT_THAT(said, HasSubstr("31"));
}

TEST(WallClock, ABoxWithoutAClockHasTheDateOfAHost) {
  for (const int year : {1970, 2001, 2026, 2101}) {
    const auto date = dateOf(showing(year), kLeftAlone, told(2027, 300), 3700s);
    EXPECT_EQ(date.at, noonIn(2027) + 1h) << year;
    EXPECT_THAT(date.source, HasSubstr("usb"));
  }
  // 0.3 s of the host, 2 s of the way, 0.36 s of an hour by its own clock.
  EXPECT_NEAR(told(2027, 300).error_s(3700s).value(), 2.66, 1e-9);
}

TEST(WallClock, ItsOwnClockIsBetterThanAHosts) {
  auto clock = showing(2026);
  clock.synchronised = true;
  EXPECT_EQ(dateOf(clock, kLeftAlone, told(2027, 1), 200s).at, noonIn(2026));
}

TEST(WallClock, TheBetterOfTwoHostsIsBelieved) {
  const auto unknown = told(2027, messages::TimeOfDay::kErrorUnknown), good = told(2027, 10),
             bad = told(2027, 5000, 200s);
  EXPECT_TRUE(good.isBetterThan(unknown, 200s));
  EXPECT_FALSE(unknown.isBetterThan(good, 200s));
  EXPECT_TRUE(unknown.isBetterThan(unknown, 200s)) << "the later one";
  EXPECT_FALSE(bad.isBetterThan(good, 200s));
  constexpr auto kMonth = 100s + hours{24 * 30};
  EXPECT_TRUE(told(2027, 5000, kMonth).isBetterThan(good, kMonth)) << "a month by the box's own clock: 259 s";
  EXPECT_FALSE(unknown.error_s(200s));
}

messages::TimeOfDay timeOf(int year, std::uint32_t error_ms, seconds later = 0s) {
  return {.utc_us = duration_cast<microseconds>((noonIn(year) + later).time_since_epoch()).count(),
          .error_ms = error_ms};
}

TEST(ToldTimes, TakesTheFirstThatCanBeAndThenBetterOnes) {
  ToldTimes all;
  EXPECT_EQ(all.take({.utc_us = 1, .error_ms = 0}, 10s, "usb"), "") << "1970";
  EXPECT_FALSE(all.best());
  EXPECT_THAT(all.take(timeOf(2027, 5000), 10s, "usb"), HasSubstr("usb"));
  EXPECT_EQ(all.take(timeOf(2027, 10, 3s), 10s, "tcp:a"), "");
  EXPECT_EQ(all.best()->at(10s), noonIn(2027) + 3s);
  EXPECT_EQ(all.take(timeOf(2027, 8000, 5s), 10s, "tcp:b"), "");
  EXPECT_EQ(all.best()->at(10s), noonIn(2027) + 3s) << "worse";
}

// Else a result could be accepted a second before it was proposed.
TEST(ToldTimes, ADateDoesNotGoBackWhenTheSameClockIsToldAgain) {
  constexpr auto kUtc = 900ms, kSinceStart = 5100ms;
  const auto told_at = [&](milliseconds later) {
    return ToldTime{
        {.utc_us = duration_cast<microseconds>(noonIn(2027).time_since_epoch() + kUtc + later).count(), .error_ms = 10},
        kSinceStart + later,
        "usb"};
  };
  for (auto later = 0ms; later < 2s; later += 50ms)
    EXPECT_EQ(told_at(0ms).at(kSinceStart + later), told_at(later).at(kSinceStart + later)) << later.count() << " ms";
}

TEST(ToldTimes, DoubtsAllOnceTwoHaveContradictedEachOther) {
  ToldTimes all;
  all.take(timeOf(2027, 10), 10s, "usb");
  EXPECT_THAT(all.take(timeOf(2029, 10), 10s, "tcp:a"), HasSubstr("tcp:a"));
  EXPECT_FALSE(all.best()->error_s(10s));
  EXPECT_THAT(dateOf(showing(1970), kLeftAlone, all.best(), 10s).source, HasSubstr("unknown"));
  all.take(timeOf(2029, 10), 20s, "tcp:a");
  EXPECT_FALSE(all.best()->error_s(20s)) << "the one that is wrong may well say it again";
}

}  // namespace
}  // namespace probebox::app
