#pragma once
#include <compare>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"

// Everything that the store keeps about a result.
namespace probebox::store {

// As stored in the file and sent on the wire: never renumber.
enum class State : std::uint8_t { proposed = 0, accepted = 1, active = 2, retired = 3, refused = 4 };
// State in the file only: a row that does not match its checksum. Only damage() reports it.
inline constexpr int kDamagedState = 5;
std::string_view name(State state);

using Id = std::uint64_t;  // opaque; a later result has a higher one

// Subject and validity of a result. At most one result is active, and at most one waits, for each combination.
struct Binding {
  std::string subject;  // the question that the result answers, such as "delay"; several methods may share one
  std::string probe_serial_number;
  std::string machine;
  std::string mounting;

  friend auto operator<=>(const Binding&, const Binding&) = default;
};

struct Record {
  Id id{};
  State state{};
  std::string method;
  Binding binding;
  std::variant<metrology::Result, metrology::Refusal> content;
  std::string proposed_utc;  // ISO 8601, as the caller gave it; empty when it did not happen
  std::string accepted_utc;
  std::string accepted_by;
  std::string retired_utc;  // cleared when it comes back into force

  const metrology::Result* result() const { return std::get_if<metrology::Result>(&content); }
  const metrology::Refusal* refusal() const { return std::get_if<metrology::Refusal>(&content); }
};

// One change of state, for the history of a result.
struct Transition {
  std::uint64_t number{};  // increases with time, over all results
  Id result{};
  std::string method;
  Binding binding;
  State to{};
  std::string utc;
  std::string by;      // empty: the box itself
  std::string remark;  // of the person; may be empty
};

// A change of state that is to be stored.
struct Change {
  Id result{};
  State from{};
  State to{};
  std::string by{};  // empty: the box itself
  std::string remark{};
};

// Origin of a result besides its data.
struct Origin {
  std::vector<Id> rests_on{};  // results that it was computed with
  std::string by{};            // who vouches for it; empty: the box itself
  std::string remark{};        // kept in its history
};

// A result that is to be stored.
struct Proposal {
  Binding binding;
  metrology::Result result;
  Origin origin;
};

// A result that another one rests on.
struct Dependence {
  Id id{};
  std::string subject;  // empty: the store has lost that result
};

// All results, or the later ones, without their values.
struct Contents {
  struct Head {
    Id id{};
    State state{};
    Binding binding;
    std::string accepted_by;
  };
  struct RestsOn {
    Id id{};
    Id other{};
  };
  std::vector<Head> heads;
  std::vector<RestsOn> dependences;
  std::vector<Transition> transitions;  // of these results, in the order in which they happened
  Id next_id{};                         // of the next result
};

// Selects transitions.
struct HistoryRange {
  Id result{};             // 0: of all results
  std::string subject{};   // empty: about everything
  std::uint64_t after{};   // only later than this number
  std::size_t count{100};  // maximum number
};

}  // namespace probebox::store
