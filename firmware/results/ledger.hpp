#pragma once
#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/subject.hpp"
#include "firmware/store/record.hpp"

// All results and their states, in memory. No disk, no lock, no clock.
namespace probebox::results {

using store::Binding;
using store::Change;
using store::Id;
using store::State;
using store::Transition;

// One result as decisions see it. Numbers are those of transitions; 0: there was none.
struct Entry {
  Id id{};
  State state{};
  Binding binding;
  std::string accepted_by;
  std::vector<Id> rests_on;  // rising
  std::uint64_t proposed{};
  std::uint64_t activated{};  // when it came into force last
  std::string activated_by;
  std::uint64_t changed{};  // last of all

  bool isInForce() const { return state == State::active; }
  bool isWaiting() const { return state == State::accepted; }
};

class Ledger {
 public:
  // Takes results, what they rest on, and their transitions; later ones than those that it has.
  void add(const store::Contents& contents);
  // Takes a new result, whose proposal is among the next transitions.
  void add(Id id, const Binding& binding, std::vector<Id> rests_on);
  void apply(std::span<const Transition> transitions);
  // Forgets a result.
  void remove(Id id);

  const Entry* find(Id id) const;
  const Entry* inForce(const Binding& binding) const;
  const Entry* waiting(const Binding& binding) const;
  const Entry* newestProposed(const Binding& binding) const;
  // The result that a rollback would bring back: of those retired that ever were in force, the one retired last.
  const Entry* retiredLast(const Binding& binding) const;
  // By rising number, those of this probe, machine and mounting (`here`, of any subject).
  std::vector<const Entry*> all(State state, const Binding& here) const;
  // The last decision of a person about the binding.
  std::uint64_t decided(const Binding& binding) const;
  // The newest result about the binding that rests on both.
  const Entry* restingOn(const Binding& binding, Id one, Id other) const;

  Id lastId() const { return entries_.empty() ? 0 : entries_.rbegin()->first; }
  Id nextId() const { return next_id_; }
  std::uint64_t lastNumber() const { return last_number_; }

  friend bool operator==(const Ledger& a, const Ledger& b);

 private:
  const Entry* newestOf(const Binding& binding, State state) const;
  void put(Entry entry);
  void setState(Entry& entry, State state);
  std::set<Id>& idsIn(State state) { return ids_.at(static_cast<std::size_t>(state)); }
  const std::set<Id>& idsIn(State state) const { return ids_.at(static_cast<std::size_t>(state)); }

  std::map<Id, Entry> entries_;
  std::array<std::set<Id>, 5> ids_;  // by state: few are in force or wait, and these are asked for all the time
  std::map<Binding, std::uint64_t> decided_;  // of lost results, too
  Id next_id_{1};
  std::uint64_t last_number_{};
};

// "Result 5", and "Result 5 about delay".
std::string named(Id id);
std::string named(const Entry& entry);

// The binding of another subject with the same probe, machine and mounting.
Binding withSubject(Binding binding, const Subject& subject);

}  // namespace probebox::results
