#include "firmware/results/ledger.hpp"

#include <algorithm>
#include <tuple>
#include <utility>

namespace probebox::results {
namespace {

// True for the same probe, machine and mounting.
bool isOfOnePlace(const Binding& a, const Binding& b) {
  return a.probe_serial_number == b.probe_serial_number && a.machine == b.machine && a.mounting == b.mounting;
}

auto partsOf(const Entry& entry) {
  return std::tie(entry.id, entry.state, entry.accepted_by, entry.rests_on, entry.proposed, entry.activated,
                  entry.activated_by, entry.changed);
}

}  // namespace

void Ledger::put(Entry entry) {
  const auto id = entry.id;
  remove(id);
  idsIn(entry.state).insert(id);
  entries_[id] = std::move(entry);
}

void Ledger::remove(Id id) {
  const auto found = entries_.find(id);
  if (found == entries_.end()) return;
  idsIn(found->second.state).erase(id);
  entries_.erase(found);
}

void Ledger::setState(Entry& entry, State state) {
  idsIn(entry.state).erase(entry.id);
  idsIn(state).insert(entry.id);
  entry.state = state;
}

void Ledger::add(const store::Contents& contents) {
  for (const auto& head : contents.heads)
    put({.id = head.id,
         .state = head.state,
         .binding = head.binding,
         .accepted_by = head.accepted_by,
         .rests_on = {},
         .activated_by = {}});
  for (const auto& [id, other] : contents.dependences) {
    const auto found = entries_.find(id);
    if (found != entries_.end()) found->second.rests_on.push_back(other);
  }
  apply(contents.transitions);
  for (const auto& head : contents.heads) {
    auto& entry = entries_.at(head.id);
    std::ranges::sort(entry.rests_on);
    // The state is that of the result itself: an entry of the history may be lost.
    setState(entry, head.state);
  }
  next_id_ = std::max({next_id_, contents.next_id, lastId() + 1});
}

void Ledger::add(Id id, const Binding& binding, std::vector<Id> rests_on) {
  std::ranges::sort(rests_on);
  next_id_ = std::max(next_id_, id + 1);
  put({.id = id,
       .state = State::proposed,
       .binding = binding,
       .accepted_by = {},
       .rests_on = std::move(rests_on),
       .activated_by = {}});
}

void Ledger::apply(std::span<const Transition> transitions) {
  for (const auto& each : transitions) {
    last_number_ = std::max(last_number_, each.number);
    if (each.to != State::proposed && each.to != State::refused)
      decided_[each.binding] = std::max(decided_[each.binding], each.number);
    const auto found = entries_.find(each.result);
    if (found == entries_.end()) continue;  // the result is lost
    auto& entry = found->second;
    setState(entry, each.to);
    entry.changed = each.number;
    if (each.to == State::proposed) entry.proposed = each.number;
    if (each.to == State::accepted) entry.accepted_by = each.by;
    if (each.to == State::active) entry.activated = each.number, entry.activated_by = each.by;
  }
}

const Entry* Ledger::find(Id id) const {
  const auto found = entries_.find(id);
  return found == entries_.end() ? nullptr : &found->second;
}

const Entry* Ledger::newestOf(const Binding& binding, State state) const {
  const auto& ids = idsIn(state);
  for (auto id = ids.rbegin(); id != ids.rend(); ++id)
    if (const auto& entry = entries_.at(*id); entry.binding == binding) return &entry;
  return nullptr;
}

const Entry* Ledger::inForce(const Binding& binding) const {
  return newestOf(binding, State::active);
}

const Entry* Ledger::waiting(const Binding& binding) const {
  return newestOf(binding, State::accepted);
}

const Entry* Ledger::newestProposed(const Binding& binding) const {
  return newestOf(binding, State::proposed);
}

const Entry* Ledger::retiredLast(const Binding& binding) const {
  const Entry* last = nullptr;
  for (const auto id : idsIn(State::retired)) {
    const auto& entry = entries_.at(id);
    if (entry.activated == 0 || entry.binding != binding) continue;
    if (last == nullptr || entry.changed > last->changed) last = &entry;
  }
  return last;
}

std::vector<const Entry*> Ledger::all(State state, const Binding& here) const {
  std::vector<const Entry*> found;
  for (const auto id : idsIn(state))
    if (const auto& entry = entries_.at(id); isOfOnePlace(entry.binding, here)) found.push_back(&entry);
  return found;
}

std::uint64_t Ledger::decided(const Binding& binding) const {
  const auto found = decided_.find(binding);
  return found == decided_.end() ? 0 : found->second;
}

const Entry* Ledger::restingOn(const Binding& binding, Id one, Id other) const {
  for (auto entry = entries_.rbegin(); entry != entries_.rend(); ++entry) {
    const auto& basis = entry->second.rests_on;
    const bool has_both = std::ranges::binary_search(basis, one) && std::ranges::binary_search(basis, other);
    if (has_both && entry->second.binding == binding) return &entry->second;
  }
  return nullptr;
}

bool operator==(const Ledger& a, const Ledger& b) {
  const auto same = [](const auto& one, const auto& other) {
    return partsOf(one.second) == partsOf(other.second) && one.second.binding == other.second.binding;
  };
  return a.last_number_ == b.last_number_ && std::ranges::equal(a.entries_, b.entries_, same);
}

Binding withSubject(Binding binding, const Subject& subject) {
  binding.subject = text(subject);
  return binding;
}

std::string named(Id id) {
  return "Result " + std::to_string(id);
}

std::string named(const Entry& entry) {
  return named(entry.id) + " about " + entry.binding.subject;
}

}  // namespace probebox::results
