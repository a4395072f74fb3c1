#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <optional>
#include <set>
#include <sstream>

#include "protocol/messages/fields.hpp"
#include "protocol/state/kind_of_value.hpp"
#include "tools/fleet/metrics/box_metrics.hpp"

namespace probebox::fleet {
namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

std::string textOf(const Observed& box) {
  Exposition all;
  addBox(all, &box);
  return all.text();
}

// Value of a series; nothing where it is not in the text.
std::optional<double> valueOf(const std::string& text, const std::string& series) {
  const auto at = ("\n" + text).find("\n" + series + " ");
  if (at == std::string::npos) return std::nullopt;
  return std::stod(text.substr(at + series.size() + 1));
}

// Paths in JSON of all values of a field list that are neither names nor texts for a person, as the lists have them.
template <class T>
void collect(const T& value, const std::string& path, std::set<std::string>& all) {
  T::fields(value, [&]<class Member, class... Kinds>(std::string_view name, const Member& member, std::string_view,
                                                     const Kinds&...) {
    if constexpr (!(std::same_as<Kinds, published::Identifier> || ...)) {
      const auto own = (path.empty() ? "" : path + ".") + std::string{name};
      if constexpr (messages::Structure<Member>) {
        collect(member, own, all);
      } else if constexpr (requires { requires messages::Structure<typename Member::value_type>; }) {
        if (!member.empty()) collect(member[0], own, all);
      } else if constexpr (!messages::Text<Member> || (std::same_as<Kinds, published::Complaint> || ...)) {
        all.insert(own);
      }
    }
  });
}

// A box that knows everything it can know.
Observed knowing() {
  Observed box;
  auto& status = box.status;
  status.receiver.samples = status.second_receiver.samples = 1;
  for (auto* front_end : {&status.front_end, &status.second_front_end}) {
    front_end->version = "1.0";
    front_end->inputs.samples = 1;
  }
  status.sources.resize(1);
  status.lines.resize(1);
  status.cnc_lines.resize(1);
  status.usb_ports.resize(1);
  auto& corrections = box.corrections.emplace();
  for (auto& axis : corrections.axes) axis.referenced = axis.screw.fitted = true;
  for (auto& axis : corrections.rotary) axis.known = axis.has_errors = true, axis.result_id = 4711;
  corrections.swivel.has_tool_length = true;
  corrections.in_use.resize(1);
  return box;
}

TEST(Metrics, HaveEveryValueOfTheFieldListsOnce) {
  const auto box = knowing();
  std::set<std::string> paths;
  collect(box.status, "", paths);
  collect(*box.corrections, "corrections", paths);
  // Lists of which only the length counts.
  for (const auto* list : {"inhibits", "front_end.pins", "second_front_end.pins"}) paths.insert(list);
  ASSERT_GT(paths.size(), 100U);
  std::istringstream lines{textOf(box)};
  std::map<std::string, int> families;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("# HELP") && line.ends_with(")")) ++families[line.substr(line.rfind('(') + 1)];
  }
  for (const auto& path : paths) {
    const int expected = path.ends_with("_mm_rad") ? 2 : 1;  // metres and radians
    EXPECT_EQ(families[path + ")"], expected) << path;
  }
  EXPECT_EQ(families.size(), paths.size());
}

TEST(Metrics, AreInUnitsOfTheSi) {
  auto box = knowing();
  box.status.clock.sigma_ns = 1500;
  box.status.clock.frequency_ppb = -23'000;
  box.status.uptime_ms = 61'500;
  box.status.front_end.step_ps = 8000;
  box.corrections->axes[1].screw.extension_um = 12.5;
  box.corrections->axes[1].screw.slope = 3e-6;
  box.corrections->axes[2].position_mm = -120;
  box.corrections->delay.tau_s[0] = 5.4e-3;
  box.corrections->rotary[2].errors = {0.001, 0.002, 0.003, 1e-5, 2e-5, 3e-5};
  box.corrections->last_trigger.served.correction_nm = {1, 2, 3};
  const auto text = textOf(box);
  EXPECT_EQ(valueOf(text, "probebox_clock_sigma_seconds"), 1.5e-6);
  EXPECT_EQ(valueOf(text, "probebox_clock_frequency_ratio"), -23e-6);
  EXPECT_EQ(valueOf(text, "probebox_uptime_seconds"), 61.5);
  EXPECT_EQ(valueOf(text, "probebox_front_end_step_seconds"), 8e-9);
  EXPECT_EQ(valueOf(text, "probebox_corrections_axes_screw_extension_metres{axis=\"Y\"}"), 12.5e-6);
  EXPECT_EQ(valueOf(text, "probebox_corrections_axes_screw_slope_ratio{axis=\"Y\"}"), 3e-6);
  EXPECT_EQ(valueOf(text, "probebox_corrections_axes_position_metres{axis=\"Z\"}"), -0.12);
  EXPECT_EQ(valueOf(text, "probebox_corrections_tau_seconds{axis=\"X\"}"), 5.4e-3);
  EXPECT_EQ(valueOf(text, "probebox_corrections_rotary_axes_errors_metres{axis=\"C\",along=\"Y\"}"), 2e-6);
  EXPECT_EQ(valueOf(text, "probebox_corrections_rotary_axes_errors_radians{axis=\"C\",along=\"Z\"}"), 3e-5);
  EXPECT_EQ(valueOf(text, "probebox_corrections_last_trigger_served_correction_metres{axis=\"Z\"}"), 3e-9);
}

TEST(Metrics, HaveEachLabelOnceInASeries) {
  std::istringstream lines{textOf(knowing())};
  for (std::string line; std::getline(lines, line);) {
    std::set<std::string> labels;
    for (auto at = line.find('{'); line[0] != '#' && at != std::string::npos; at = line.find("\",", at + 1)) {
      const auto begin = at + (line[at] == '{' ? 1 : 2);
      EXPECT_TRUE(labels.insert(line.substr(begin, line.find('=', begin) - begin)).second) << line;
    }
  }
}

TEST(Metrics, TellCountersFromReadings) {
  auto box = knowing();
  box.status.ledger.lost_at_source = 7;
  const auto text = textOf(box);
  EXPECT_THAT(text, HasSubstr("# TYPE probebox_ledger_lost_at_source_samples_total counter\n"));
  EXPECT_EQ(valueOf(text, "probebox_ledger_lost_at_source_samples_total"), 7);
  EXPECT_THAT(text, HasSubstr("# TYPE probebox_clock_sigma_seconds gauge\n"));
}

TEST(Metrics, LeaveOutWhatTheBoxDoesNotKnow) {
  Observed box;
  box.corrections.emplace();
  const auto text = textOf(box);
  EXPECT_THAT(text, Not(HasSubstr("probebox_receiver_")));
  EXPECT_THAT(text, Not(HasSubstr("probebox_corrections_axes_position_metres")));
  EXPECT_EQ(valueOf(text, "probebox_corrections_axes_referenced{axis=\"X\"}"), 0);
}

TEST(Metrics, SayWhereSomethingIsWrong) {
  auto box = knowing();
  box.status.sources = {{.name = "gpiochip0"}, {.name = "receiver", .problem = "unplugged: plug it in"}};
  box.status.storage_problems = {"the disk is full"};
  box.corrections->health = {published::Health::held, published::Health::off, published::Health::invalid,
                             published::Health::good};
  const auto text = textOf(box);
  EXPECT_EQ(valueOf(text, "probebox_sources_problem{source=\"gpiochip0\"}"), 0);
  EXPECT_EQ(valueOf(text, "probebox_sources_problem{source=\"receiver\"}"), 1);
  EXPECT_EQ(valueOf(text, "probebox_storage_problems"), 1);
  EXPECT_EQ(valueOf(text, "probebox_corrections_sources{source=\"screw\"}"), 2);
  EXPECT_EQ(valueOf(text, "probebox_corrections_sources{source=\"rotary\"}"), 3);
}

TEST(Metrics, TellElementsOfTheSameNameApart) {
  Observed box;
  box.status.lines = {{.name = "skip", .edges = 1}, {.name = "skip", .edges = 2}};
  const auto text = textOf(box);
  EXPECT_EQ(valueOf(text, "probebox_lines_received_edges_total{line=\"skip\"}"), 1);
  EXPECT_EQ(valueOf(text, "probebox_lines_received_edges_total{line=\"skip (2)\"}"), 2);
}

TEST(Metrics, HaveTheResultsInForceWithoutNumbersAndPersons) {
  auto box = knowing();
  messages::ResultSummary result;
  result.id = 4711;
  result.subject = "delay";
  result.accepted_by = "Ada";
  result.proposed_utc = "2026-11-26T08:15:00Z";
  result.values = {{.key = "tau_s", .value = 5.4e-3, .sd = 4e-6, .has_sd = true, .u = 5e-6, .has_u = true},
                   {.key = "centre_mm[0]", .value = 120}};
  result.about_count = 1;
  box.in_force = {result};
  auto& unit = box.unit.emplace();
  unit.sphere = {{.next_due = "2027-04-17"}};
  const auto text = textOf(box);
  EXPECT_EQ(valueOf(text, "probebox_result_value{subject=\"delay\",key=\"tau_s\"}"), 5.4e-3);
  EXPECT_EQ(valueOf(text, "probebox_result_u{subject=\"delay\",key=\"tau_s\"}"), 5e-6);
  EXPECT_EQ(valueOf(text, "probebox_result_timestamp_seconds{subject=\"delay\"}"), 1'795'680'900);
  EXPECT_EQ(valueOf(text, "probebox_certificate_due_timestamp_seconds{subject=\"sphere\"}"), 1'807'920'000);
  EXPECT_THAT(text, Not(HasSubstr("4711")));
  EXPECT_THAT(text, Not(HasSubstr("Ada")));
  EXPECT_THAT(text, Not(HasSubstr("centre_mm")));
}

TEST(Metrics, OfAResultWithoutATimeHaveNone) {
  auto box = knowing();
  box.in_force.resize(1);
  box.in_force[0].proposed_utc = "unknown, 12 s after start 3";
  EXPECT_THAT(textOf(box), Not(HasSubstr("timestamp_seconds")));
}

TEST(Metrics, OfABoxThatIsAwayAreOne) {
  Exposition all;
  addBox(all, nullptr);
  EXPECT_EQ(all.series(), 1U);
  EXPECT_EQ(valueOf(all.text(), "probebox_up"), 0);
}

TEST(Exposition, EscapesWhatStandsInQuotesAndInHelp) {
  Exposition all;
  all.add("a", "back\\slash \"quoted\"", MetricType::gauge, {{"name", "a\\b\"c\nd\xff"}}, 1);
  EXPECT_EQ(all.text(), "# HELP a back\\\\slash \"quoted\"\n# TYPE a gauge\na{name=\"a\\\\b\\\"c?d?\"} 1\n");
}

TEST(Exposition, KeepsAFamilyTogetherAndASeriesOnce) {
  Exposition all;
  all.add("a", "first", MetricType::gauge, {{"n", "1"}}, 1);
  all.add("b", "second", MetricType::counter, {}, 2);
  all.add("a", "first", MetricType::gauge, {{"n", "2"}}, 3);
  all.add("a", "first", MetricType::gauge, {{"n", "1"}}, 4);
  EXPECT_EQ(all.text(),
            "# HELP a first\n# TYPE a gauge\na{n=\"1\"} 1\na{n=\"2\"} 3\n# HELP b second\n# TYPE b counter\nb 2\n");
}

TEST(Exposition, WritesNumbersThatAreNone) {
  Exposition all;
  all.add("a", "", MetricType::gauge, {{"n", "1"}}, std::nan(""));
  all.add("a", "", MetricType::gauge, {{"n", "2"}}, -HUGE_VAL);
  all.add("a", "", MetricType::gauge, {{"n", "3"}}, 0.1);
  EXPECT_THAT(all.text(), ContainsRegex("\\{n=\"1\"\\} NaN\na\\{n=\"2\"\\} -Inf\na\\{n=\"3\"\\} 0.1\n"));
}

}  // namespace
}  // namespace probebox::fleet
