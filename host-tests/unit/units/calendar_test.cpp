#include "protocol/units/calendar.hpp"

#include <gtest/gtest.h>

namespace probebox {
namespace {

using namespace std::chrono_literals;

TEST(DayOf, TakesDaysOfTheCalendarAlone) {
  EXPECT_EQ(dayOf("2028-02-29"), 2028y / 2 / 29);
  EXPECT_EQ(dayOf("1990-01-01"), 1990y / 1 / 1);
  for (const auto* text : {"", "2027-02-29", "2028-13-01", "2028-00-10", "1989-12-31", "28-04-17", "2028/04/17",
                           "2028-4-017", "2028-04-17T", "+028-04-17"})
    EXPECT_FALSE(dayOf(text)) << text;
}

TEST(IsoUtc, HasTheSameWidthAlways) {
  EXPECT_EQ(isoUtc(std::chrono::sys_days{2026y / 11 / 6} + 8h + 5min + 9s), "2026-11-06T08:05:09Z");
  EXPECT_EQ(isoUtc(std::chrono::sys_days{1970y / 1 / 1}), "1970-01-01T00:00:00Z");
}

}  // namespace
}  // namespace probebox
