#include "tools/probebox/commands/observed_box.hpp"

#include <algorithm>
#include <utility>

#include "firmware/metrology/subject_values.hpp"
#include "tools/probebox/commands/kept_result.hpp"
#include "tools/probebox/link/stored_results.hpp"

namespace probebox::command {
namespace {

// A recording that is served as a box refuses, and so does one of before.
template <class Operation>
Outcome<std::optional<typename Operation::Answer>, Trouble> askIfKnown(link::Client& box, const Console& console) {
  auto answer = ask<Operation>(box, console);
  if (answer) return std::optional{std::move(*answer)};
  if (answer.error().status != ExitStatus::box_refused) return std::move(answer).error();
  return std::optional<typename Operation::Answer>{};
}

void keepWhatIsCompared(messages::ResultSummary& summary, const metrology::Result& result) {
  const auto compared = metrology::valuesCompared(result, summary.subject);
  const auto is_compared = [&](const messages::NamedValue& value) {
    const auto key = value.key.substr(0, value.key.find('['));  // of a component: "centre_mm[0]"
    return std::ranges::find(compared, key, &metrology::Estimate::key) != compared.end();
  };
  std::erase_if(summary.values, [&](const messages::NamedValue& value) { return !is_compared(value); });
  summary.about_count = static_cast<std::uint32_t>(summary.values.size());
}

// Nothing where the box does not give it: another program may hold the store.
Outcome<std::optional<messages::ResultSummary>, Trouble> resultInForce(link::Client& box, Console& console,
                                                                       std::uint64_t id) {
  auto listed = storedResults(box, console, {.after_id = id - 1, .newest = 0}, 1);
  auto kept = listed ? keptResult(box, console, id) : Outcome<KeptResult, Trouble>{listed.error()};
  if (!kept && kept.error().status == ExitStatus::no_box) return std::move(kept).error();
  if (!kept || kept->result() == nullptr || listed->empty() || listed->front().id != id)
    return std::optional<messages::ResultSummary>{};
  keepWhatIsCompared(listed->front(), *kept->result());
  return std::optional{std::move(listed->front())};
}

}  // namespace

Outcome<fleet::Observed, Trouble> observedBox(link::Client& box, Console& console, const fleet::Observed* before) {
  fleet::Observed all{.descriptor = box.described(), .status = {}};
  TRY(all.status, ask<messages::Status>(box, console));
  TRY(all.corrections, askIfKnown<messages::Corrections>(box, console));
  TRY(all.unit, askIfKnown<messages::DescribeUnit>(box, console));
  for (const auto id : all.status.active_results) {
    if (before != nullptr) {
      const auto known = std::ranges::find(before->in_force, id, &messages::ResultSummary::id);
      if (known != before->in_force.end()) {
        all.in_force.push_back(*known);
        continue;
      }
    }
    TRY(auto result, resultInForce(box, console, id));
    if (result) all.in_force.push_back(std::move(*result));
  }
  return all;
}

}  // namespace probebox::command
