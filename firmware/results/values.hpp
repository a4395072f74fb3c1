#pragma once
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "firmware/results/ledger.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::results {

using store::Record;

// How a result differs from another one about the same subject.
struct Difference {
  bool differs{};                           // by more than a person accepts unasked
  std::string in_words;                     // the values that differ
  std::optional<std::string> less_certain;  // the value whose uncertainty grows most
  bool exceeds_u{};                         // some value has moved by more than its standard uncertainty
};

// What decisions ask about values. Each gives the same answer for the same results.
struct Values {
  Binding here;      // probe, machine and mounting that this box describes; any subject
  bool has_y{true};  // false: a lathe of X and Z, which needs no delay of Y
  std::size_t most_tool_lengths{};
  // Null for a result that is damaged, or that there is not. State and persons are those of the ledger.
  std::function<std::shared_ptr<const Record>(Id)> record;
  std::shared_ptr<const Record> recordOf(const Entry* entry) const {
    return entry == nullptr ? nullptr : record(entry->id);
  }
  // The events that bring a result into force; an error where this box, as it is described, cannot have it.
  std::function<Outcome<std::vector<Event>>(const Record&)> activation;
  // The event by which nothing about the subject is in force; nothing where the core does not follow it.
  std::function<std::optional<Event>(const std::string& subject)> none;
  std::function<Difference(const Record& next, const Record& present)> difference;
  // The turning axis from the spindle's, of one from a tip and the offset of that tip; nothing where they give none.
  std::function<std::optional<metrology::Result>(const Record& from_tip, const Record& offset)> sum;
  // Number of the tool that carries the probe of a centreline from a tip.
  std::function<std::uint32_t(const Record& from_tip)> probe_tool;
};

}  // namespace probebox::results
