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
  const auto proposed = keptResult(box, console, acceptance.id);
  if (!proposed) return proposed.error();
  subject = proposed->summary.subject;
  if (proposed->result() == nullptr || proposed->summary.state == messages::ResultState::active)
    return std::optional<Comparison>{};
  const auto in_force = keptInForce(box, console);
  if (!in_force) return in_force.error();
  const auto same = std::ranges::find_if(
      *in_force, [&](const KeptResult& other) { return answersTheSame(other.summary, proposed->summary); });
  const bool first = same == in_force->end();
  return std::optional{comparisonOf(*proposed->result(), first ? nullptr : same->result(), first ? 0 : same->summary.id,
                                    casefolder::rotaryAxisOf(subject))};
}

// "y" or "yes" alone is consent.
bool agrees(Console& console) {
  console.err() << "put it into force although it differs? [y/N] " << std::flush;
  std::string answer;
  std::getline(console.in(), answer);
  return answer == "y" || answer == "Y" || answer == "yes";
}

// True where a person at a terminal says so; a script says it on the command line.
bool isMeant(Console& console) {
  return console.hasKeys() && !console.json() && agrees(console);
}

Trouble differs(const std::string& what) {
  return {ExitStatus::failed, "differs", what + "; measure again, or accept it with --although-it-differs"};
}

Trouble differs(const Comparison& comparison, std::uint64_t id) {
  return differs(printed("result %llu differs from result %llu, which is in force, by %.1f sd, more than %g",
                         static_cast<unsigned long long>(id), static_cast<unsigned long long>(comparison.in_force),
                         *comparison.worstInSd(), Comparison::kMostInSd));
}

ExitStatus refuse(const Trouble& trouble, std::uint64_t id, const Json& beside, Console& console) {
  if (console.interrupted()) return console.fail(interruption());
  if (console.json()) console.object({{"proposed_id", id}, {"comparison", beside}});
  return console.fail(trouble);
}

// The box judges by itself too, and by more than values: two results may be such that they cannot be compared.
Outcome<messages::AcceptResult::Answer, Trouble> accept(link::Client& box, const Acceptance& acceptance, bool meant,
                                                        Console& console) {
  messages::AcceptResult::Request request{.id = acceptance.id, .by = acceptance.by};
  request.although_it_differs = meant;
  auto accepted = ask<messages::AcceptResult>(box, console, request);
  const bool unsure = !accepted && accepted.error().name == nameOf(messages::ErrorCode::differs);
  if (!unsure) return accepted;
  console.note(accepted.error().what);
  if (!isMeant(console)) return differs(accepted.error().what);
  request.although_it_differs = true;
  return ask<messages::AcceptResult>(box, console, request);
}

}  // namespace

ExitStatus acceptOn(link::Client& box, const Acceptance& acceptance, Console& console) {
  std::string subject;
  Json beside;  // null where there is nothing to compare
  bool meant = acceptance.although_it_differs;
  const auto comparison = compare(box, acceptance, subject, console);
  if (!comparison) {
    // A box of before has no such request; it decides by itself.
    if (comparison.error().name != nameOf(messages::ErrorCode::unknown_operation))
      return console.fail(comparison.error());
    console.note("the firmware of this box cannot show what is in force beside this result: update it");
  } else if (*comparison) {
    beside = describe(**comparison);
    if (!console.json()) console.line(page(**comparison, acceptance.id, subject));
    if ((*comparison)->differs() && !meant) meant = isMeant(console);
    if ((*comparison)->differs() && !meant)
      return refuse(differs(**comparison, acceptance.id), acceptance.id, beside, console);
  }
  const auto accepted = accept(box, acceptance, meant, console);
  if (!accepted) return console.fail(accepted.error());
  tellAccepted(acceptance.id, acceptance.by, *accepted, beside, console);
  return ExitStatus::ok;
}

}  // namespace probebox::command
