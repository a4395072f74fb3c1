#include "tools/probebox/commands/kept_result.hpp"

#include <utility>

#include "firmware/json/result_json.hpp"
#include "firmware/metrology/dataset/quantity.hpp"
#include "tools/case/quantities.hpp"
#include "tools/probebox/link/stored_results.hpp"
#include "tools/probebox/text/report.hpp"
#include "tools/probebox/text/report_kept_result.hpp"

namespace probebox::command {
namespace {

using messages::ResultDocument;
using messages::ResultState;

struct Fetched {
  messages::ResultSummary summary;
  bool dataset_kept{};
  std::string text;
};

Trouble inPart(std::uint64_t id) {
  return {ExitStatus::failed, "incomplete",
          "the box sent only a part of result " + std::to_string(id) + "; ask again, or update its firmware"};
}

Outcome<Fetched, Trouble> fetch(link::Client& box, Console& console, std::uint64_t id, ResultDocument document) {
  Fetched fetched;
  while (true) {
    TRY(auto piece, ask<messages::GetResult>(box, console, {id, document, fetched.text.size()}));
    if (fetched.text.empty()) fetched.summary = std::move(piece.summary), fetched.dataset_kept = piece.dataset_kept;
    const bool goes_on = piece.offset == fetched.text.size() && !piece.bytes.empty();
    fetched.text += piece.bytes;
    if (fetched.text.size() == piece.total_bytes) return fetched;
    if (!goes_on || fetched.text.size() > piece.total_bytes) return inPart(id);
    console.progress(printed("fetching result %llu: %zu of %llu bytes", static_cast<unsigned long long>(id),
                             fetched.text.size(), static_cast<unsigned long long>(piece.total_bytes)));
  }
}

Trouble unreadable(std::uint64_t id, const Error& error) {
  return {ExitStatus::failed, "unreadable-result",
          "result " + std::to_string(id) + " is not readable here (" + error.what + "); update this command"};
}

}  // namespace

bool KeptResult::isSum() const {
  return !dataset_kept && result() != nullptr && result()->find(metrology::quantity::kStylusOffsetInForce) != nullptr;
}

Outcome<KeptResult, Trouble> keptResult(link::Client& box, Console& console, std::uint64_t id) {
  TRY(auto fetched, fetch(box, console, id, ResultDocument::result));
  KeptResult kept{std::move(fetched.summary), metrology::Refusal{}, fetched.dataset_kept};
  if (kept.summary.state == ResultState::refused) {
    auto refusal = json::refusalFromJson(fetched.text);
    if (!refusal) return unreadable(id, refusal.error());
    kept.content = std::move(refusal).value();
  } else {
    auto result = json::resultFromJson(fetched.text);
    if (!result) return unreadable(id, result.error());
    kept.content = std::move(result).value();
  }
  return kept;
}

Outcome<ResultWithHistory, Trouble> resultWithHistory(link::Client& box, Console& console, std::uint64_t id) {
  TRY(auto kept, keptResult(box, console, id));
  // The list knows what a result rests on now, and who said that its case was measured here; refusals are not in it.
  TRY(auto listed, storedResults(box, console, {.after_id = id - 1, .newest = 0}, 1));
  if (!listed.empty() && listed.front().id == id) {
    kept.summary.rests_on = std::move(listed.front().rests_on);
    kept.summary.as_this_machine_by = std::move(listed.front().as_this_machine_by);
  }
  TRY(auto history, storedTransitions(box, console, {id, "", 0}));
  return ResultWithHistory{std::move(kept), std::move(history)};
}

Json describe(const ResultWithHistory& result) {
  const auto& kept = result.kept;
  Json object{{"id", kept.summary.id}};
  object.update(describe(kept.summary));
  object["standing"] = standingOf(kept.summary);
  if (kept.result() != nullptr) {
    object.update(describe(*kept.result(), casefolder::rotaryAxisOf(kept.summary.subject)));
  } else {
    object.update(describe(*kept.refusal()));
  }
  object["dataset_kept"] = kept.dataset_kept;
  object["history"] = Json::array();
  for (const auto& transition : result.history) object["history"].push_back(describe(transition));
  return object;
}

Outcome<std::string, Trouble> keptDataset(link::Client& box, Console& console, std::uint64_t id) {
  TRY(auto fetched, fetch(box, console, id, ResultDocument::dataset));
  if (!fetched.text.empty()) return std::move(fetched.text);
  const auto number = std::to_string(id);
  return Trouble{ExitStatus::failed, "dataset-not-kept",
                 "the box no longer keeps the dataset of result " + number +
                     " (it keeps those of accepted results and of the newest 20 others; a sum of two results has none "
                     "of its own): measure again, or report the results that it rests on, or the case folder that "
                     "calibrate --save wrote; probebox show " +
                     number + " has its values and what it rests on"};
}

bool answersTheSame(const messages::ResultSummary& one, const messages::ResultSummary& other) {
  return one.subject == other.subject && one.probe == other.probe && one.machine == other.machine &&
         one.mounting == other.mounting;
}

Outcome<Comparison, Trouble> comparisonByBox(link::Client& box, Console& console, const KeptResult& proposed) {
  if (proposed.result() == nullptr) return Trouble{ExitStatus::failed, "refused", proposed.refusal()->reason};
  messages::AcceptResult::Request question{.id = proposed.summary.id};
  question.compare_only = true;
  TRY(const auto answer, ask<messages::AcceptResult>(box, console, question));
  Comparison comparison;
  if (answer.compared_with == 0) {
    comparison = nothingBeside(*proposed.result(), proposed.summary.subject);
  } else {
    TRY(const auto in_force, keptResult(box, console, answer.compared_with));
    comparison = comparisonOf(answer, *proposed.result(), in_force.result());
  }
  comparison.notes = answer.notes;
  return comparison;
}

Outcome<std::vector<KeptResult>, Trouble> keptInForce(link::Client& box, Console& console) {
  TRY(const auto status, ask<messages::Status>(box, console));
  std::vector<KeptResult> all;
  for (const auto id : status.active_results) {
    TRY(auto kept, keptResult(box, console, id));
    all.push_back(std::move(kept));
  }
  return all;
}

}  // namespace probebox::command
