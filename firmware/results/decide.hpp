#pragma once
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "firmware/results/values.hpp"
#include "firmware/store/failure.hpp"
#include "protocol/units/outcome.hpp"

// Which results come into force, wait, are retired or refused: pure functions of the ledger and of the values of
// results.
namespace probebox::results {

using store::Failure;

// Whether a cut is on, or may be: then nothing comes into force or out of it.
struct Cut {
  bool on{};
};

struct Accept {
  Id id{};
  std::string by;
  bool although_it_differs{};
};
// A result that waits, now that the cut is over.
struct Activate {
  Id id{};
};
// Back to the result that was in force before, about the subject of a result in force, or of one that waits, which is
// withdrawn.
struct RollBack {
  Id id{};
  std::string by;
};
struct RollBackSubject {
  Binding binding;
  std::string by;
};
// The sum of a centreline from a tip and the offset of that tip, both in force, that was never made.
struct MakeMissingSum {};
using Command = std::variant<Accept, Activate, RollBack, RollBackSubject, MakeMissingSum>;

struct Decision {
  // In this order. Those of a proposal have the number that the ledger gives next.
  std::optional<store::Proposal> proposal;
  std::vector<Change> changes;
  Id compared_with{};                          // the result that was in force before; 0: none
  std::vector<std::string> notes;              // what a person should know about the effect
  std::vector<std::string> notes_if_it_waits;  // the same where a cut begins before anybody has been told

  bool isEmpty() const { return !proposal && changes.empty(); }
};

// Decides by the ledger alone. Refusals say why, and what to do.
Outcome<Decision, Failure> decide(const Ledger& ledger, const Values& values, const Command& command, const Cut& cut);

// What accept would compare and say; changes nothing.
Outcome<Decision, Failure> compareOnly(const Ledger& ledger, const Values& values, Id id);

// The changes of a decision that are undone where a cut begins before anybody has been told of them, the last one
// first: what came into force waits again, or is retired again, and what left it is in force. A sum whose part waits
// again is only proposed.
std::vector<Change> undoneByCut(const Decision& decision);

// The ledger once the decision is stored.
Ledger after(Ledger ledger, const Decision& decision);

// Why this box, as it is described now, cannot have the result in force; nothing for one that is retired.
std::optional<std::string> whyNotHere(const Values& values, const Record& record);

// The offset in force of the stylus that this tool carries; null without one.
const Entry* stylusOffset(const Ledger& ledger, const Values& values, std::uint32_t probe_tool);

// The refusal of a change that a cut forbids.
Failure cutIsOn();

}  // namespace probebox::results
