#include <algorithm>
#include <array>
#include <limits>
#include <string>
#include <vector>

#include "protocol/units/wording.hpp"
#include "tools/case/quantities.hpp"
#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/stored_results.hpp"
#include "tools/probebox/text/report.hpp"
#include "tools/probebox/text/report_kept_result.hpp"

namespace probebox::command {
namespace {

using messages::ResultSummary;

// In this order: what counts now, what will, what could, what would elsewhere, what did.
constexpr std::array kOrder{"in force", "waits for the end of the cut", "proposed", "not in force here", "retired"};
constexpr std::size_t kMostValues = 8;  // of one result; `show` has all

// Who did what last, and when.
std::string whoAndWhen(const ResultSummary& result) {
  if (result.accepted_by.empty()) return "proposed " + result.proposed_utc;
  std::string all = "accepted by " + shown(result.accepted_by) + " " + result.accepted_utc;
  return result.retired_utc.empty() ? all : all + ", retired " + result.retired_utc;
}

std::string pageOf(const ResultSummary& result) {
  std::string all = printed("  %-5llu ", static_cast<unsigned long long>(result.id)) + result.subject + ", " +
                    result.method + ", " + whoAndWhen(result);
  if (const auto verdict = verdictOf(result); !verdict.empty()) all += "\n          " + verdict;
  const auto axis = casefolder::rotaryAxisOf(result.subject);
  // Where nothing says which values are about the subject, all are.
  const std::size_t about = result.about_count == 0 ? result.values.size() : result.about_count;
  for (std::size_t i = 0; i < std::min({kMostValues, about, result.values.size()}); ++i) {
    const auto& value = result.values[i];
    const auto label = casefolder::quantityLabel(value.key, axis);
    all += printed("\n          %-22s ", label.name.c_str()) +
           casefolder::withUncertainty(label, value.value, value.uncertainty());
  }
  if (about > kMostValues)
    all +=
        "\n          and " + std::to_string(about - kMostValues) + " more: probebox show " + std::to_string(result.id);
  if (!result.why_not_in_force.empty()) all += "\n          " + shown(result.why_not_in_force);
  for (const auto& other : result.rests_on) {
    if (other.retired)
      all += "\n          rests on result " + std::to_string(other.id) + ", which is retired: repeat this one";
  }
  if (!result.warnings.empty())
    all += "\n          " + std::to_string(result.warnings.size()) +
           (result.warnings.size() == 1 ? " warning: " : " warnings, first: ") + result.warnings.front();
  return all;
}

bool isAbout(const ResultSummary& result, const std::string& subject) {
  return subject.empty() || result.subject == subject || result.method == subject;
}

Trouble nothingAbout(const std::string& subject, const std::vector<ResultSummary>& all) {
  const auto meant = subjectMeant(subject, all);
  return {ExitStatus::failed, "not_found",
          "no result about " + subject + " is stored" + (meant.empty() ? "; probebox results lists all" : meant)};
}

}  // namespace

ExitStatus run(const Results& options, const std::string& uri, Console& console) {
  const auto box = openBox(uri, console);
  if (!box) return console.fail(box.error());
  const auto all = storedResults(**box, console, {}, std::numeric_limits<std::size_t>::max());
  if (!all) return console.fail(all.error());
  bool nothing = true;
  for (const std::string_view standing : kOrder) {
    bool first = true;
    for (const auto& result : *all) {
      if (standingOf(result) != standing || !isAbout(result, options.subject)) continue;
      nothing = false;
      if (console.json()) {
        Json object = describe(result);
        object["standing"] = standingOf(result);
        console.object(object);
        continue;
      }
      if (first) console.line(std::string{standing});
      first = false;
      console.line(pageOf(result));
    }
  }
  if (!nothing) return ExitStatus::ok;
  if (!options.subject.empty()) return console.fail(nothingAbout(options.subject, *all));
  if (console.json()) console.object({{"results", Json::array()}});
  console.note("no result is stored: probebox calibrate measures one");
  return ExitStatus::ok;
}

}  // namespace probebox::command
