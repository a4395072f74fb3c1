#include "tools/probebox/commands/kept_report.hpp"

#include <algorithm>
#include <limits>
#include <utility>
#include <vector>

#include "firmware/json/dataset_json.hpp"
#include "tools/case/readable.hpp"
#include "tools/probebox/link/stored_results.hpp"
#include "tools/probebox/text/machine_verdict.hpp"
#include "tools/probebox/text/report_kept_result.hpp"
#include "tools/report/subjects.hpp"

namespace probebox::command {
namespace {

Outcome<report::Earlier, Trouble> earlierOne(link::Client& box, Console& console, std::uint64_t id) {
  TRY(auto kept, keptResult(box, console, id));
  auto* result = std::get_if<metrology::Result>(&kept.content);
  if (result == nullptr)
    return Trouble{
        ExitStatus::failed, "unreadable-result",
        "the box lists result " + std::to_string(id) + " with values and keeps a refusal; update its firmware"};
  return report::Earlier{"result " + std::to_string(id), kept.summary.proposed_utc, std::move(*result)};
}

// The result in force and the earlier ones about the same subject, from the same probe, machine and mounting.
Outcome<report::Before, Trouble> beforeOf(link::Client& box, Console& console, const messages::ResultSummary& summary,
                                          const std::vector<messages::ResultSummary>& all) {
  constexpr std::size_t kEarlier = 9;  // the page shows the trend of ten
  report::Before before;
  std::vector<std::uint64_t> earlier;
  for (const auto& other : all) {
    // A refused run is about the same subject and has no values.
    const bool refused = other.state == messages::ResultState::refused;
    if (other.id == summary.id || refused || !answersTheSame(other, summary)) continue;
    if (other.id < summary.id) earlier.push_back(other.id);
    if (other.state != messages::ResultState::active) continue;
    TRY(auto in_force, earlierOne(box, console, other.id));
    before.in_force = std::move(in_force);
  }
  if (earlier.size() > kEarlier) earlier.erase(earlier.begin(), earlier.end() - kEarlier);
  for (const auto id : earlier) {
    TRY(auto one, earlierOne(box, console, id));
    before.history.push_back(std::move(one));
  }
  return before;
}

}  // namespace

Outcome<std::optional<report::Earlier>, Trouble> acceptedBefore(link::Client& box, Console& console,
                                                                const messages::ResultSummary& summary,
                                                                const std::vector<messages::ResultSummary>& all) {
  const messages::ResultSummary* newest = nullptr;
  for (const auto& other : all) {
    const bool before = other.id < summary.id && !other.accepted_utc.empty() && answersTheSame(other, summary);
    if (before && (newest == nullptr || other.id > newest->id)) newest = &other;
  }
  if (newest == nullptr) return std::optional<report::Earlier>{};
  TRY(auto found, earlierOne(box, console, newest->id));
  return std::optional{std::move(found)};
}

std::vector<messages::Requirement> requirementsOf(link::Client& box, Console& console) {
  auto says = ask<messages::DescribeMachine>(box, console);
  return says ? std::move(says->requirements) : std::vector<messages::Requirement>{};
}

std::optional<report::Conformity> conformityOf(const messages::ResultSummary& result,
                                               const std::vector<messages::Requirement>& requirements) {
  const auto* const requirement = requirementOf(requirements, result.subject);
  const auto decisive = decisiveValue(result, requirement);
  // A check was held against limits of its own.
  if (requirement == nullptr || !decisive || !decisive->proof || isAbout(result.subject, SubjectKind::check))
    return std::nullopt;
  const bool is_deviation = casefolder::hasIdealZero(decisive->key);
  const auto stated = is_deviation ? limitText(*decisive) : "of which U has the " + limitText(*decisive);
  return report::Conformity{*decisive->proof, decisive->text + ", " + stated, is_deviation};
}

void addWhatItRestsOn(report::Subject& subject, const messages::ResultSummary& listed) {
  subject.rests_on = restsOnInWords(listed);
  subject.rests_on_retired = std::ranges::any_of(listed.rests_on, &messages::RestsOn::retired);
}

Outcome<report::Subject, Trouble> keptSubject(link::Client& box, Console& console, std::uint64_t id) {
  TRY(auto kept, keptResult(box, console, id));
  TRY(const auto text, keptDataset(box, console, id));
  TRY(const auto all, storedResults(box, console, {}, std::numeric_limits<std::size_t>::max()));
  TRY(auto before, beforeOf(box, console, kept.summary, all));
  const auto requirements = requirementsOf(box, console);
  // Everything that the box has to say has come: reading a large dataset takes longer than it waits for a silent host.
  auto dataset = json::datasetFromJson(text);
  if (!dataset) {
    return Trouble{ExitStatus::failed, "unreadable-result",
                   "the dataset of result " + std::to_string(id) + " is not readable here (" + dataset.error().what +
                       "); update this command"};
  }
  const auto name = "result " + std::to_string(id) + ", " + standingOf(kept.summary);
  report::Subject subject{name, kept.summary.method, std::move(dataset).value(), std::move(kept.content)};
  subject.before = std::move(before);
  subject.about = kept.summary.subject;
  if (const auto listed = std::ranges::find(all, id, &messages::ResultSummary::id); listed != all.end()) {
    addWhatItRestsOn(subject, *listed);
    subject.conformity = conformityOf(*listed, requirements);
  }
  if (subject.result() != nullptr && !report::recallResiduals(subject))
    console.note(name + " is another value when its dataset is solved by this version; its page has no residuals");
  return subject;
}

}  // namespace probebox::command
