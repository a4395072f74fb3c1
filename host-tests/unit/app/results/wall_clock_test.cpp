#include "firmware/app/results/wall_clock.hpp"

#include <gtest/gtest.h>

#include "protocol/units/calendar.hpp"

namespace probebox::app {
namespace {

using namespace std::chrono;

sys_seconds noonIn(int year) {
  return sys_days{std::chrono::year{year} / November / 29} + hours{12};
}

bool isDate(const std::string& utc) {
  return dayOf(utc.substr(0, 10)).has_value();
}

TEST(WallClock, DatesOnlyWhatItCanKnow) {
  const WallClock kept{.is_kept_right = true, .start = 7}, left_alone{.is_kept_right = false, .start = 7};
  EXPECT_EQ(dateOf(noonIn(2026), 12s, kept), "2026-11-29T12:00:00Z");
  EXPECT_FALSE(isDate(dateOf(noonIn(2026), 12s, left_alone))) << "it may be the day of the image";
  for (const int year : {1970, 2001, 2025, 2101}) EXPECT_FALSE(isDate(dateOf(noonIn(year), 12s, kept))) << year;
  EXPECT_TRUE(isDate(dateOf(noonIn(2056), 12s, kept)));
}

TEST(WallClock, SaysWhereADateComesFrom) {
  EXPECT_EQ(clockSource(false, 16'000'000, false), "") << "nobody keeps it right";
  const auto synchronised = clockSource(true, 12'000, true), at_start = clockSource(false, 16'000'000, true);
  EXPECT_NE(synchronised.find("0.012 s"), std::string::npos) << synchronised;
  EXPECT_NE(at_start.find("hardware"), std::string::npos) << at_start;
  setWallClock({.is_kept_right = true, .start = 3});
  EXPECT_EQ(isDate(utcNow()), dateSource(utcNow()) != "unknown");
}

TEST(WallClock, SaysWhenItWasOfTheStarts) {
  const auto said = dateOf(noonIn(1970), 4000s, {.is_kept_right = true, .start = 31});
  EXPECT_NE(said.find("4000"), std::string::npos);
  EXPECT_NE(said.find("31"), std::string::npos);
}

}  // namespace
}  // namespace probebox::app
