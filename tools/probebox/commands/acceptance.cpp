#include "tools/probebox/commands/acceptance.hpp"

#include <algorithm>
#include <istream>
#include <optional>
#include <utility>

#include "tools/case/quantities.hpp"
#include "tools/probebox/commands/kept_result.hpp"
#include "tools/probebox/text/comparison.hpp"
#include "tools/probebox/text/report.hpp"

namespace probebox::command {
namespace {

// Nothing where there is nothing to compare: a refusal, which the box does not accept, or a result that is in force.
Outcome<std::optional<Comparison>, Trouble> compare(link::Client& box, const Acceptance& acceptance,
                                                    std::string& subject, Console& console) {
  TRY(const auto proposed, keptResult(box, console, acceptance.id));
  subject = proposed.summary.subject;
  if (proposed.result() == nullptr || proposed.summary.state == messages::ResultState::active)
    return std::optional<Comparison>{};
  TRY(const auto in_force, keptInForce(box, console));
  const auto same = std::ranges::find_if(
      in_force, [&](const KeptResult& other) { return answersTheSame(other.summary, proposed.summary); });
  const bool first = same == in_force.end();
  return std::optional{comparisonOf(*proposed.result(), first ? nullptr : same->result(), first ? 0 : same->summary.id,
                                    casefolder::rotaryAxisOf(subject))};
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
  std::string subject;
  Json beside;  // null where there is nothing to compare
  const auto comparison = compare(box, acceptance, subject, console);
  if (!comparison) {
    // A box of before has no such request; it decides by itself.
    if (comparison.error().name != nameOf(messages::ErrorCode::unknown_operation))
      return console.fail(comparison.error());
    console.note("the firmware of this box cannot show what is in force beside this result: update it");
  } else if (*comparison) {
    beside = describe(**comparison);
    if (!console.json()) console.line(page(**comparison, acceptance.id, subject));
  }
  const auto accepted = accept(box, acceptance, console);
  if (!accepted) return refuse(accepted.error(), acceptance.id, beside, console);
  tellAccepted(acceptance.id, acceptance.by, *accepted, beside, console);
  return ExitStatus::ok;
}

}  // namespace probebox::command
