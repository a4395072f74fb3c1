#include "tools/probebox/text/machine_verdict.hpp"

#include <algorithm>
#include <gtest/gtest.h>
#include <set>

#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "tools/case/readable.hpp"
#include "tools/probebox/commands/kept_report.hpp"
#include "tools/probebox/text/subject_words.hpp"

namespace probebox::command {
namespace {

using messages::NamedValue;
using messages::Requirement;
using messages::ResultState;
using messages::ResultSummary;

constexpr const char* kNow = "2026-11-30T12:00:00Z";

ResultSummary result(std::uint64_t id, const std::string& subject, std::vector<NamedValue> values,
                     ResultState state = ResultState::active) {
  ResultSummary one;
  one.id = id;
  one.state = state;
  one.subject = subject;
  one.method = "delay-multi-speed";
  one.probe = "probe";
  one.machine = "machine";
  one.mounting = "spindle";
  one.proposed_utc = "2026-11-28T12:00:00Z";
  one.accepted_utc = "2026-11-28T12:05:00Z";
  one.accepted_by = "Ada";
  one.values = std::move(values);
  return one;
}

NamedValue value(const std::string& key, double number, double u) {
  return {.key = key, .value = number, .sd = u, .has_sd = true, .u = u, .has_u = true};
}

// tau of 5 ms with U = 10 us.
ResultSummary delay(std::uint64_t id = 1) {
  return result(id, "delay", {value("tau_s", 5e-3, 5e-6)});
}

MachineKnown known(std::vector<ResultSummary> results, std::vector<Requirement> requirements) {
  MachineKnown all{.link_up = true,
                   .status = messages::Status::Answer{},
                   .corrections = messages::Corrections::Answer{},
                   .results = std::move(results),
                   .requirements = std::move(requirements)};
  all.status->utc = kNow;
  all.status->clock.state = ClockState::locked;
  return all;
}

Requirement limitOfTimes(double limit_us) {
  return {.subject = "delay", .limit_us = limit_us};
}

// As the box says it, which was asked to measure again within some days of those that remain.
MachineKnown withDelayDue(MachineKnown all, published::DueState state, double remaining_days) {
  all.status->due.push_back({.name = "delay",
                             .result_id = 1,
                             .state = state,
                             .has_time = state != published::DueState::not_known,
                             .remaining_s = remaining_days * 86'400});
  return all;
}

const SubjectTile& tileOf(const MachineVerdict& verdict, const std::string& subject) {
  return *std::ranges::find(verdict.tiles, subject, &SubjectTile::subject);
}

TEST(MachineVerdict, SaysYesWhereEveryLimitIsKeptAndNothingIsDue) {
  const auto verdict = judge(withDelayDue(known({delay()}, {limitOfTimes(20)}), published::DueState::good, 28));
  EXPECT_EQ(verdict.may_cut, MayCut::yes);
  EXPECT_TRUE(verdict.more.empty());
  ASSERT_EQ(verdict.tiles.size(), 1);
  EXPECT_EQ(verdict.tiles[0].may_cut, MayCut::yes);
  EXPECT_NEAR(*verdict.tiles[0].decisive->ratio, 0.5, 1e-9) << "U of 10 us in 20 us";
  EXPECT_NEAR(*verdict.tiles[0].age_days, 2, 1e-9);
  EXPECT_EQ(dueText(verdict.tiles[0]), "due in 28 days");
}

TEST(MachineVerdict, AsksToLookWhereNoLimitIsStatedAndNamesTheFile) {
  const auto verdict = judge(known({delay()}, {}));
  EXPECT_EQ(verdict.may_cut, MayCut::check);
  EXPECT_NE(verdict.reason.find("machine.toml"), std::string::npos);
  EXPECT_NE(verdict.reason.find("[[requirement]]"), std::string::npos);
  EXPECT_EQ(verdict.tiles[0].decisive->proof, std::nullopt);
  EXPECT_EQ(verdict.tiles[0].may_cut, MayCut::unknown) << "nothing is required of it";
}

TEST(MachineVerdict, StopsWhereUExceedsItsLimit) {
  const auto verdict = judge(known({delay()}, {limitOfTimes(8)}));
  EXPECT_EQ(verdict.may_cut, MayCut::stop);
  EXPECT_EQ(tileOf(verdict, "delay").decisive->proof, metrology::Proof::fails);
}

// What the Machine page says of a result and what its report says is one decision.
TEST(MachineVerdict, IsThatOfTheReport) {
  const auto of = [](double limit_us) { return conformityOf(delay(), {limitOfTimes(limit_us)}); };
  ASSERT_TRUE(of(20).has_value());
  EXPECT_EQ(of(20)->proof, metrology::Proof::conforms);
  EXPECT_EQ(of(8)->proof, metrology::Proof::fails);
  EXPECT_FALSE(of(8)->is_deviation) << "the limit bounds U";
  EXPECT_FALSE(of(0).has_value()) << "no limit of times is stated";
  EXPECT_FALSE(conformityOf(delay(), {}).has_value());
  const auto errors = result(3, "rotary-c", {value("deviation_XC_at_60_deg_mm", -0.007, 0.001)});
  const auto of_errors = conformityOf(errors, {{.subject = "rotary-c", .limit_um = 8}});
  ASSERT_TRUE(of_errors.has_value());
  EXPECT_EQ(of_errors->proof, metrology::Proof::not_proven);
  EXPECT_TRUE(of_errors->is_deviation);
}

// ISO 14253-1: an error of 7 um with U = 2 um is beyond 4 um, within 10 um, and neither is proven for 8 um.
TEST(MachineVerdict, JudgesErrorsWithTheirUncertainty) {
  const auto axis = [](double limit_um) {
    const auto errors =
        result(3, "rotary-c",
               {value("deviation_XC_at_60_deg_mm", -0.007, 0.001), value("deviation_YC_at_60_deg_mm", 0.002, 0.001)});
    return judge(known({errors}, {{.subject = "rotary-c", .limit_um = limit_um}}));
  };
  EXPECT_EQ(axis(4).may_cut, MayCut::stop);
  EXPECT_EQ(axis(8).may_cut, MayCut::check);
  EXPECT_EQ(axis(10).may_cut, MayCut::yes);
  const auto verdict = axis(10);
  EXPECT_EQ(verdict.tiles[0].decisive->key, "deviation_XC_at_60_deg_mm") << "the largest error is the decisive one";
  EXPECT_NEAR(verdict.tiles[0].decisive->value, -7, 1e-9);
  EXPECT_EQ(verdict.tiles[0].decisive->unit, "um");
  EXPECT_NEAR(*verdict.tiles[0].decisive->ratio, 0.9, 1e-9);
}

NamedValue ofUnknownU(const std::string& key, double number) {
  return {.key = key, .value = number};
}

MachineVerdict judgedAxis(std::vector<NamedValue> values, double limit_um) {
  return judge(known({result(3, "rotary-c", std::move(values))}, {{.subject = "rotary-c", .limit_um = limit_um}}));
}

// 6 um with U = 0.5 um is beyond 5 um for certain, at 130 % with U; 4 um with U = 4 um may be within, at 160 %.
TEST(MachineVerdict, ABrokenLimitIsNotHiddenByALessCertainValue) {
  const auto certain = value("deviation_XC_at_60_deg_mm", 0.006, 0.00025);
  const auto doubtful = value("deviation_YC_at_60_deg_mm", 0.004, 0.002);
  for (const auto& values : {std::vector{certain, doubtful}, std::vector{doubtful, certain}}) {
    const auto verdict = judgedAxis(values, 5);
    EXPECT_EQ(verdict.may_cut, MayCut::stop);
    EXPECT_EQ(verdict.tiles[0].decisive->key, certain.key);
  }
}

TEST(MachineVerdict, AValueOfUnknownUIsNotHiddenByOneThatKeepsTheLimit) {
  const auto keeps = value("deviation_XC_at_60_deg_mm", 0.002, 0.00025);
  const auto unknown = ofUnknownU("deviation_YC_at_60_deg_mm", 0.001);
  for (const auto& values : {std::vector{keeps, unknown}, std::vector{unknown, keeps}}) {
    const auto verdict = judgedAxis(values, 5);
    EXPECT_EQ(verdict.may_cut, MayCut::check);
    EXPECT_EQ(verdict.tiles[0].decisive->key, unknown.key);
    EXPECT_FALSE(verdict.tiles[0].decisive->ratio);
  }
  EXPECT_EQ(judgedAxis({keeps}, 5).may_cut, MayCut::yes);
}

// An error that keeps its limit says nothing of a delay in the same result that does not.
TEST(MachineVerdict, JudgesEveryValueThatHasALimit) {
  const auto mixed = [](double u_of_delay_s) {
    const auto one =
        result(3, "rotary-c", {value("deviation_XC_at_60_deg_mm", 0.001, 0.0001), value("tau_s", 5e-3, u_of_delay_s)});
    return judge(known({one}, {{.subject = "rotary-c", .limit_um = 5, .limit_us = 8}}));
  };
  EXPECT_EQ(mixed(1e-6).may_cut, MayCut::yes);
  EXPECT_EQ(mixed(1e-6).tiles[0].decisive->key, "deviation_XC_at_60_deg_mm") << "of equal answers the error";
  EXPECT_EQ(mixed(5e-6).may_cut, MayCut::stop) << "U of 10 us in 8 us";
  EXPECT_EQ(mixed(5e-6).tiles[0].decisive->key, "tau_s");
}

// An axis should point along its nominal direction: the lean itself is bounded, not only its U.
TEST(MachineVerdict, ALeanIsHeldAgainstItsLimitItself) {
  const auto tilted = [](double lean_rad) {
    const auto one =
        result(5, "spindle-tilt", {value("A_tilt_rad[0]", 0, 1e-6), value("A_tilt_rad[1]", lean_rad, 1e-6)});
    return judge(known({one}, {{.subject = "spindle-tilt", .limit_urad = 20}}));
  };
  EXPECT_EQ(tilted(15e-6).may_cut, MayCut::yes);
  EXPECT_NEAR(*tilted(15e-6).tiles[0].decisive->ratio, 17.0 / 20, 1e-9);
  EXPECT_EQ(tilted(-19e-6).may_cut, MayCut::check);
  EXPECT_EQ(tilted(500e-6).may_cut, MayCut::stop);
}

TEST(MachineVerdict, ALimitThatBoundsNoValueIsNoYes) {
  const auto of = [](Requirement requirement) {
    requirement.subject = "delay";
    return judge(withDelayDue(known({delay()}, {requirement}), published::DueState::good, 28));
  };
  EXPECT_EQ(of({.limit_us = 20}).may_cut, MayCut::yes);
  const auto other = of({.limit_urad = 20});
  EXPECT_EQ(other.may_cut, MayCut::check);
  EXPECT_EQ(other.tiles[0].may_cut, MayCut::check);
  ASSERT_EQ(other.tiles[0].idle_limits.size(), 1);
  EXPECT_NE(other.tiles[0].idle_limits[0].find("limit_urad"), std::string::npos);
  EXPECT_NE(other.tiles[0].idle_limits[0].find("limit_us"), std::string::npos) << "the one that would bound tau";
  const auto both = of({.limit_um = 5, .limit_us = 20});
  EXPECT_EQ(both.may_cut, MayCut::check);
  EXPECT_EQ(both.tiles[0].idle_limits.size(), 1) << "limit_us is kept, limit_um bounds nothing";
}

TEST(MachineVerdict, IsDueAfterItsDays) {
  const auto verdict = judge(withDelayDue(known({delay()}, {limitOfTimes(20)}), published::DueState::overdue, -1));
  EXPECT_EQ(verdict.may_cut, MayCut::check);
  EXPECT_NE(verdict.reason.find("overdue"), std::string::npos);
}

TEST(MachineVerdict, AsksForWhatIsRequiredAndNotInForce) {
  auto proposed = delay();
  proposed.state = ResultState::proposed;
  const auto verdict = judge(known({proposed}, {limitOfTimes(20)}));
  EXPECT_EQ(verdict.may_cut, MayCut::check);
  ASSERT_EQ(verdict.tiles.size(), 1);
  EXPECT_EQ(verdict.tiles[0].id, 0);
}

TEST(MachineVerdict, IgnoresWhatIsOfAnotherMachine) {
  auto foreign = delay();
  foreign.why_not_in_force = "of another machine";
  EXPECT_TRUE(judge(known({foreign}, {})).tiles.empty());
}

TEST(MachineVerdict, StopsWhereTheCorrectionsAreNotValid) {
  auto all = known({delay()}, {limitOfTimes(20)});
  all.corrections->mask = bitOf(SourceKind::screw);
  all.corrections->health[static_cast<std::size_t>(SourceKind::screw)] = published::Health::invalid;
  all.corrections->valid = false;
  const auto verdict = judge(all);
  EXPECT_EQ(verdict.may_cut, MayCut::stop);
  EXPECT_NE(verdict.reason.find("screw"), std::string::npos);
  all.corrections->valid = true;
  all.corrections->health[static_cast<std::size_t>(SourceKind::screw)] = published::Health::good;
  EXPECT_EQ(judge(all).may_cut, MayCut::yes);
}

TEST(MachineVerdict, AFailedCheckStopsBeforeAnybodyHasAcceptedIt) {
  const auto check = [](double verdict) {
    return result(9, "check",
                  {value("deviation_Xcen_mm", 0.05, 0.001),
                   {.key = "verdict", .value = verdict},
                   {.key = "worst_ratio", .value = 2.6}},
                  ResultState::proposed);
  };
  EXPECT_EQ(judge(known({delay(), check(2)}, {limitOfTimes(20)})).may_cut, MayCut::stop);
  EXPECT_EQ(judge(known({delay(), check(1)}, {limitOfTimes(20)})).may_cut, MayCut::check) << "nothing is proven";
  EXPECT_EQ(judge(known({delay(), check(0)}, {limitOfTimes(20)})).may_cut, MayCut::yes);
}

TEST(MachineVerdict, NamesWhoeverSaysThatACutIsOn) {
  auto all = known({delay()}, {limitOfTimes(20)});
  EXPECT_EQ(judge(all).cut, "");
  all.corrections->inhibited = true;
  EXPECT_NE(judge(all).cut, "") << "a line of the box has no name";
  all.status->inhibits.push_back({"tcp:127.0.0.1:9", "Ada", kNow});
  EXPECT_NE(judge(all).cut.find("Ada"), std::string::npos);
}

TEST(MachineVerdict, KnowsNothingWithoutALink) {
  auto all = known({delay()}, {limitOfTimes(20)});
  all.link_up = false;
  const auto verdict = judge(all);
  EXPECT_EQ(verdict.may_cut, MayCut::unknown);
  EXPECT_EQ(verdict.tiles.size(), 1) << "what was known stays on the page";
  all.link_up = true;
  all.corrections.reset();
  EXPECT_EQ(judge(all).may_cut, MayCut::unknown) << "a recording has no corrections";
}

TEST(MachineVerdict, TheMostSeriousReasonComesFirst) {
  auto all = withDelayDue(known({delay()}, {limitOfTimes(8)}), published::DueState::overdue, -1);
  all.status->clock.state = ClockState::holdover;
  const auto verdict = judge(all);
  EXPECT_EQ(verdict.may_cut, MayCut::stop);
  EXPECT_EQ(verdict.more.size(), 2) << "overdue, and the clock";
}

TEST(MachineVerdict, AnUnknownDateIsNeitherAgeNorDue) {
  auto all = withDelayDue(known({delay()}, {limitOfTimes(20)}), published::DueState::not_known, 0);
  all.status->utc = "unknown, 12 s after start 7";
  const auto verdict = judge(all);
  EXPECT_FALSE(verdict.tiles[0].age_days);
  EXPECT_EQ(verdict.may_cut, MayCut::check) << "it may be due";
}

TEST(Trend, HoldsTheLastTenAboutTheSame) {
  std::vector<ResultSummary> all;
  for (std::uint64_t id = 1; id <= 14; ++id) all.push_back(delay(id));
  all.push_back(result(15, "delay-x", {value("tau_s", 1, 1)}));
  all[12].state = ResultState::refused;
  const auto decisive = decisiveValue(all[13], nullptr);
  ASSERT_TRUE(decisive);
  const auto trend = trendOf(all[13], *decisive, all);
  ASSERT_EQ(trend.points.size(), kTrendPoints);
  EXPECT_EQ(trend.points.front().id, 4);
  EXPECT_EQ(trend.points.back().id, 14);
  EXPECT_NEAR(trend.points.back().value, 5000, 1e-9) << "us";
  EXPECT_NEAR(*trend.points.back().u, 10, 1e-9);
}

// Values 10, 12, 10, 12, 11: mean 11, mean moving range (2 + 2 + 2 + 1) / 4.
TEST(Trend, ControlLimitsFollowTheMovingRange) {
  std::vector<TrendPoint> points;
  for (const double number : {10.0, 12.0, 10.0, 12.0}) points.push_back({.value = number});
  EXPECT_FALSE(controlLimits(points)) << "four are too few";
  points.push_back({.value = 11});
  const auto limits = controlLimits(points);
  ASSERT_TRUE(limits);
  EXPECT_NEAR(limits->mean, 11, 1e-12);
  EXPECT_NEAR(limits->high - limits->mean, 2.66 * 7 / 4, 1e-12);
  EXPECT_NEAR(limits->mean - limits->low, 2.66 * 7 / 4, 1e-12);
}

TEST(SubjectWords, EveryLiveMethodHasAGroupOfThePage) {
  const std::set<std::string_view> groups{"delay", "axis", "tool", "head", "table", "screw", "machine"};
  std::set<std::string_view> found;
  for (const auto* method : procedure::liveMethods()) {
    EXPECT_TRUE(groups.contains(groupOf(*method->solver))) << method->name();
    found.insert(groupOf(*method->solver));
  }
  EXPECT_EQ(found, groups);
  const auto groupNamed = [](std::string_view name) { return groupOf(*metrology::methodNamed(name)); };
  EXPECT_EQ(groupNamed("head-pivot"), "head");
  EXPECT_EQ(groupNamed("table-pivot"), "table");
  EXPECT_EQ(groupNamed("periodic-check"), "machine");
  EXPECT_EQ(groupNamed("spindle-offset-four"), "axis");
}

TEST(SubjectWords, NamesWhatAPersonCallsIt) {
  EXPECT_EQ(subjectTitle("rotary-c"), "Rotary axis C");
  EXPECT_EQ(subjectTitle("delay"), "Delay");
  EXPECT_EQ(subjectTitle("delay-xy"), "Delay along XY");
  EXPECT_EQ(subjectTitle("tool-4"), "Tool 4");
  EXPECT_EQ(subjectTitle("something-else"), "something else");
}

TEST(Typeset, SetsUnitsAndLeavesWords) {
  EXPECT_EQ(casefolder::typeset("tau 5.2 +/- 0.4 us"), "tau 5.2 \u00b1 0.4 \u00b5s");
  EXPECT_EQ(casefolder::typeset("um"), "\u00b5m");
  EXPECT_EQ(casefolder::typeset("um/min"), "\u00b5m/min");
  EXPECT_EQ(casefolder::typeset("radius (um) 3 um, 4 urad; 5 mm"), "radius (\u00b5m) 3 \u00b5m, 4 \u00b5rad; 5 mm");
  EXPECT_EQ(casefolder::typeset("give us 12 umbrellas"), "give us 12 umbrellas");
}

}  // namespace
}  // namespace probebox::command
