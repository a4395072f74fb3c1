// Members of ResultsInForce that return to the result that was in force before.
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/app/results/acceptance.hpp"
#include "firmware/app/results/result_events.hpp"
#include "firmware/app/results/results_in_force.hpp"

namespace probebox::app {
namespace {

store::Failure cutIsOn(const std::string& what) {
  return {store::Reason::cut_is_on, "A cut is in progress, and results cannot change: " + what};
}

}  // namespace

ResultsInForce::RolledBack ResultsInForce::rollBack(const std::string& subject, const std::string& by) {
  return rollBack(bindingFor(subjectNamed(subject)), by);
}

ResultsInForce::RolledBack ResultsInForce::rollBack(store::Id id, const std::string& by) {
  TRY(const auto found, store_.find(id));
  // One that does not fit any more can be gone back from as well.
  if (auto other = otherBinding(found)) return *other;
  if (found.state == store::State::accepted) {
    auto withdrawn = store_.withdraw(id, by, utcNow());
    readStore();
    if (!withdrawn) return withdrawn.error();
    return Return{{.retired = std::move(*withdrawn), .active = std::nullopt}, {}};
  }
  if (found.state != store::State::active) {
    return store::Failure{store::Reason::not_possible_now,
                          named(id) + " is " + std::string{store::name(found.state)} +
                              ", not in force: name the result that is, or its subject (" + found.binding.subject +
                              ")."};
  }
  return rollBack(found.binding, by);
}

ResultsInForce::RolledBack ResultsInForce::rollBack(const store::Binding& binding, const std::string& by) {
  auto no_cut = noCut();
  if (!no_cut) return cutIsOn("repeat the rollback when it is over.");
  const auto present = store_.active(binding);
  if (present && !*present) {
    // It would bring one back.
    if (auto beside = whyBeside(binding.subject)) return *beside;
  }
  const auto before = store_.retiredLast(binding);
  if (before && *before) {
    const auto told = fitActivation(**before);
    if (!told) return cannotComeBack(**before, told.error().what);
  }
  auto changed = store_.rollBack(binding, by, utcNow());
  if (!changed) {
    catchUp();
    return changed.error();
  }
  std::vector<store::Record> as_before;  // the one that leaves force comes first
  if (changed->active && before && *before) as_before.push_back(**before);
  if (changed->retired && present && *present) as_before.push_back(**present);
  if (tookBack(as_before)) {
    readStore();
    return cutIsOn("repeat the rollback when it is over.");
  }
  readStore();
  if (changed->active)
    tell(*changed->active);
  else
    tellNone(binding.subject);
  no_cut.reset();
  Return back{std::move(*changed), {}};
  if (back.active) back.notes = notesOn(*back.active);
  if (!back.retired) return back;
  for (auto& sentence : dependantsOn(back.retired->id)) back.notes.push_back(std::move(sentence));
  return back;
}

}  // namespace probebox::app
