#include "tools/probebox/commands/acceptance.hpp"

#include <algorithm>
#include <istream>
#include <optional>
#include <utility>

#include "tools/probebox/commands/kept_result.hpp"
#include "tools/probebox/text/comparison.hpp"
#include "tools/probebox/text/report.hpp"
#include "tools/probebox/text/report_kept_result.hpp"

namespace probebox::command {
namespace {

// Nothing where there is nothing to compare: a refusal or a result for another probe, which the box does not accept, or
// a result that is in force. adopted_by: who said that its case, which names no machine, was measured here.
Outcome<std::optional<Comparison>, Trouble> compare(link::Client& box, const Acceptance& acceptance,
                                                    std::string& subject, std::string& adopted_by, Console& console) {
  TRY(const auto proposed, keptResult(box, console, acceptance.id));
  subject = proposed.summary.subject;
  adopted_by = proposed.summary.as_this_machine_by;
  if (!proposed.dataset_kept && !proposed.isSum() && proposed.summary.state == messages::ResultState::proposed)
    console.note("the box does not keep the measured data of result " + std::to_string(acceptance.id) +
                 " (of results that nobody has accepted, those of the newest 20): there can be no report of it, "
                 "and a certificate without the limits of its case");
  if (proposed.result() == nullptr || proposed.summary.state == messages::ResultState::active ||
      !proposed.summary.why_not_in_force.empty())
    return std::optional<Comparison>{};
  const auto compared = comparisonByBox(box, console, proposed);
  // An objection found by the comparison also answers the acceptance.
  return compared ? std::optional{*compared} : std::nullopt;
}

// "y" or "yes" alone is consent.
bool agrees(Console& console) {
  console.err() << "put it into force although it differs? [y/N] " << std::flush;
  std::string answer;
  std::getline(console.in(), answer);
  return answer == "y" || answer == "Y" || answer == "yes";
}

bool isDifference(const Trouble& trouble) {
  return trouble.name == nameOf(messages::ErrorCode::differs);
}

ExitStatus refuse(const Trouble& trouble, std::uint64_t id, const Json& beside, Console& console) {
  if (console.interrupted()) return console.fail(interruption());
  if (console.json() && isDifference(trouble)) console.object({{"proposed_id", id}, {"comparison", beside}});
  return console.fail(isDifference(trouble) ? Trouble{ExitStatus::failed, trouble.name, trouble.what} : trouble);
}

// Whether two results differ is the box's judgement alone: it knows at which heights they hold, and which cannot be
// compared at all.
Outcome<messages::AcceptResult::Answer, Trouble> accept(link::Client& box, const Acceptance& acceptance,
                                                        Console& console) {
  messages::AcceptResult::Request request{.id = acceptance.id, .by = acceptance.by};
  request.although_it_differs = acceptance.although_it_differs;
  auto accepted = ask<messages::AcceptResult>(box, console, request);
  if (accepted || !isDifference(accepted.error()) || !console.hasKeys() || console.json()) return accepted;
  console.note(accepted.error().what);
  if (!agrees(console)) return accepted;
  request.although_it_differs = true;
  return ask<messages::AcceptResult>(box, console, request);
}

}  // namespace

ExitStatus acceptOn(link::Client& box, const Acceptance& acceptance, Console& console) {
  std::string subject, adopted_by;
  Json beside;  // null where there is nothing to compare
  const auto comparison = compare(box, acceptance, subject, adopted_by, console);
  if (!comparison) return console.fail(comparison.error());
  if (*comparison) {
    beside = describe(**comparison);
    if (!console.json()) {
      console.line(page(**comparison, acceptance.id, subject));
      if (!adopted_by.empty()) console.line("  " + adoptedBy(adopted_by));
    }
  }
  auto accepted = accept(box, acceptance, console);
  if (!accepted) return refuse(accepted.error(), acceptance.id, beside, console);
  if (!console.json() && comparison && *comparison) {
    const auto& said = (*comparison)->notes;
    std::erase_if(accepted->notes,
                  [&](const std::string& note) { return std::ranges::find(said, note) != said.end(); });
  }
  tellAccepted(acceptance.id, acceptance.by, *accepted, beside, console);
  return ExitStatus::ok;
}

}  // namespace probebox::command
