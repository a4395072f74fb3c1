#pragma once
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/text/comparison.hpp"

namespace probebox::command {

// Everything that a box stores about one result.
struct KeptResult {
  messages::ResultSummary summary;  // without values and warnings
  std::variant<metrology::Result, metrology::Refusal> content;
  bool dataset_kept{};

  const metrology::Result* result() const { return std::get_if<metrology::Result>(&content); }
  const metrology::Refusal* refusal() const { return std::get_if<metrology::Refusal>(&content); }
  // A centreline from the tip plus the offset of its stylus, which the box added: it has no data of its own.
  bool isSum() const;
};

Outcome<KeptResult, Trouble> keptResult(link::Client& box, Console& console, std::uint64_t id);

// A result with what it rests on now, and with all that has happened to it.
struct ResultWithHistory {
  KeptResult kept;
  std::vector<messages::ResultTransition> history;  // oldest first
};
Outcome<ResultWithHistory, Trouble> resultWithHistory(link::Client& box, Console& console, std::uint64_t id);
Json describe(const ResultWithHistory& result);

// Fetches the dataset of a result as JSON text. Trouble: the box no longer keeps it, with the remedy.
Outcome<std::string, Trouble> keptDataset(link::Client& box, Console& console, std::uint64_t id);

// True for two results of the same subject, probe, machine and mounting: at most one of them can be in force.
bool answersTheSame(const messages::ResultSummary& one, const messages::ResultSummary& other);

// Asks the box how a result compares with the one in force of its subject, and changes nothing. Trouble: it cannot be
// accepted, with the reason.
Outcome<Comparison, Trouble> comparisonByBox(link::Client& box, Console& console, const KeptResult& proposed);

// The results in force, of every subject.
Outcome<std::vector<KeptResult>, Trouble> keptInForce(link::Client& box, Console& console);

}  // namespace probebox::command
