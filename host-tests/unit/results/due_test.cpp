#include "firmware/results/due.hpp"

#include <gtest/gtest.h>

#include "firmware/metrology/dataset/conditions.hpp"

namespace probebox::results {
namespace {

using namespace std::chrono;
using published::DueState;

constexpr sys_seconds kMeasured = sys_days{year{2026} / November / 1} + hours{8};

store::Record measured(std::vector<metrology::Condition> conditions) {
  store::Record record;
  record.id = 17;
  record.binding.subject = "delay";
  metrology::Result result;
  result.conditions = std::move(conditions);
  record.content = std::move(result);
  return record;
}

const store::Record kRecord = measured({{"measured_utc", "2026-11-01T08:00:00Z"},
                                        {std::string{metrology::kCuttingKey}, "3600 of a"},
                                        {"temperature_c", "20.5"}});

TEST(Due, ByDays) {
  const Schedule schedule{.subject = "delay", .days = 30, .cutting_h = {}, .temperature_k = {}};
  const auto after = dueOf(schedule, &kRecord, {.utc = kMeasured + days{12}});
  EXPECT_EQ(after.state, DueState::good);
  EXPECT_EQ(after.result_id, 17U);
  EXPECT_EQ(after.remaining_s, 18 * 86'400);
  EXPECT_EQ(after.due_utc, "2026-12-01T08:00:00Z");
  EXPECT_FALSE(after.has_cutting || after.has_temperature);
  EXPECT_EQ(dueOf(schedule, &kRecord, {.utc = kMeasured + days{30}}).state, DueState::good);
  EXPECT_EQ(dueOf(schedule, &kRecord, {.utc = kMeasured + days{30} + seconds{1}}).state, DueState::overdue);
}

TEST(Due, WithoutADateItIsNotKnown) {
  const Schedule schedule{.subject = "delay", .days = 30, .cutting_h = {}, .temperature_k = {}};
  const auto now = dueOf(schedule, &kRecord, {});
  EXPECT_EQ(now.state, DueState::not_known);
  EXPECT_EQ(now.due_utc, "2026-12-01T08:00:00Z") << "a host with a clock can tell";
  EXPECT_FALSE(now.has_time);
  const auto then = measured({{"measured_utc", "unknown, 12 s after start 7"}});
  EXPECT_EQ(dueOf(schedule, &then, {.utc = kMeasured}).state, DueState::not_known);
}

TEST(Due, ByHoursOfCutting) {
  const Schedule schedule{.subject = "delay", .days = {}, .cutting_h = 2, .temperature_k = {}};
  EXPECT_EQ(dueOf(schedule, &kRecord, {.cutting = CuttingCount{10'000, "a"}}).remaining_cutting_s, 800);
  EXPECT_EQ(dueOf(schedule, &kRecord, {.cutting = CuttingCount{10'801, "a"}}).state, DueState::overdue);
  EXPECT_EQ(dueOf(schedule, &kRecord, {.cutting = CuttingCount{20'000, "b"}}).state, DueState::not_known)
      << "the counter was lost";
}

TEST(Due, HoursOfCuttingAreKeptInWholeSecondsThatNeverRoundUp) {
  for (const double s : {0.0, 1000.6, 12'345'678.4}) {
    const CuttingCount count{s, "a"};
    const auto then = measured({{std::string{metrology::kCuttingKey}, count.text()}});
    const auto due =
        dueOf({.subject = "delay", .days = {}, .cutting_h = 2, .temperature_k = {}}, &then, {.cutting = count});
    EXPECT_EQ(due.state, DueState::good) << s;
    EXPECT_NEAR(due.remaining_cutting_s, 7200, 1) << s;
  }
  EXPECT_FALSE(CuttingCount::parse("3600"));
  EXPECT_FALSE(CuttingCount::parse("3600x of a"));
}

TEST(Due, ByTemperatureToEitherSide) {
  const Schedule schedule{.subject = "delay", .days = {}, .cutting_h = {}, .temperature_k = 2};
  EXPECT_EQ(dueOf(schedule, &kRecord, {.temperature_c = 22.0}).remaining_temperature_k, 0.5);
  EXPECT_EQ(dueOf(schedule, &kRecord, {.temperature_c = 22.6}).state, DueState::overdue);
  EXPECT_EQ(dueOf(schedule, &kRecord, {.temperature_c = 18.4}).state, DueState::overdue);
  EXPECT_EQ(dueOf(schedule, &kRecord, {}).state, DueState::not_known);
}

TEST(Due, WhatComesFirstDecidesAndOverdueGoesBeforeNotKnown) {
  const Schedule schedule{.subject = "delay", .days = 30, .cutting_h = 2, .temperature_k = 2};
  const Circumstances fine{.utc = kMeasured + days{1}, .cutting = CuttingCount{4000, "a"}, .temperature_c = 20.5};
  EXPECT_EQ(dueOf(schedule, &kRecord, fine).state, DueState::good);
  auto cut_long = fine;
  cut_long.cutting->s = 20'000;
  cut_long.utc.reset();
  EXPECT_EQ(dueOf(schedule, &kRecord, cut_long).state, DueState::overdue);
}

TEST(Due, WhatWasNeverMeasuredIsDue) {
  const auto due = dueOf({.subject = "centreline", .days = 30, .cutting_h = {}, .temperature_k = {}}, nullptr, {});
  EXPECT_EQ(due.state, DueState::not_measured);
  EXPECT_TRUE(published::isDue(due.state));
  EXPECT_EQ(due.name, "centreline");
}

}  // namespace
}  // namespace probebox::results
