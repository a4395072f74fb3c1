#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "firmware/metrology/result.hpp"
#include "firmware/store/failure.hpp"
#include "protocol/units/outcome.hpp"

// Results of calibrations in one SQLite file. A result is PROPOSED by the solver, ACCEPTED by a person, ACTIVE from
// then on, and RETIRED when the next one takes its place; a refusal is kept too. What a call has acknowledged survives
// a killed process and a pulled plug. One thread; time is given by the caller.
namespace probebox::store {

// As stored in the file and sent on the wire: never renumber.
enum class State : std::uint8_t { proposed = 0, accepted = 1, active = 2, retired = 3, refused = 4 };
std::string_view name(State state);

using Id = std::uint64_t;  // opaque; a later result has a higher one

// What a result holds for. At most one result is active for each combination.
struct Binding {
  std::string method;
  std::string probe_serial_number;
  std::string machine;
  std::string mounting;

  friend bool operator==(const Binding&, const Binding&) = default;
};

struct Record {
  Id id{};
  State state{};
  Binding binding;
  std::variant<metrology::Result, metrology::Refusal> content;
  std::string proposed_utc;  // ISO 8601, as the caller gave it; empty when it did not happen
  std::string accepted_utc;
  std::string accepted_by;
  std::string retired_utc;

  const metrology::Result* result() const { return std::get_if<metrology::Result>(&content); }
  const metrology::Refusal* refusal() const { return std::get_if<metrology::Refusal>(&content); }
};

// One change of state, for the history of a result.
struct Transition {
  Id result{};
  State to{};
  std::string utc;
  std::string by;  // empty: by the box itself
};

class Database;

class Store {
 public:
  // Makes the file when it is missing, brings an older one to the newest schema, and checks every page. A damaged file
  // is moved aside, never deleted: notice() then says where to. A newer schema, another program's file, a read-only or
  // locked file and a full disk are refused by name, and the file is left as it is.
  static Outcome<Store, Failure> open(const std::string& path);

  Store(Store&&) noexcept;
  Store& operator=(Store&&) noexcept;
  ~Store();

  // What a person must know about the opening; empty when all was well.
  const std::string& notice() const { return notice_; }

  // dataset: what was measured, as text, for `calibrate --save`; may be empty. utc: now, ISO 8601.
  Outcome<Id, Failure> propose(const Binding& binding, const metrology::Result& result, std::string_view dataset,
                               std::string_view utc);
  Outcome<Id, Failure> refuse(const Binding& binding, const metrology::Refusal& refusal, std::string_view dataset,
                              std::string_view utc);

  // Accepts and activates a proposed result, and retires the one that was active for the same binding, all or nothing.
  // To accept an active result again changes nothing and gives the record as it stands.
  Outcome<Record, Failure> accept(Id id, std::string_view by, std::string_view utc);

  Outcome<Record, Failure> find(Id id);
  Outcome<std::optional<Record>, Failure> active(const Binding& binding);
  Outcome<std::vector<Record>, Failure> newest(std::size_t count);  // newest first, every state
  Outcome<std::string, Failure> dataset(Id id);
  Outcome<std::vector<Transition>, Failure> history(Id id);  // in the order in which it happened

 private:
  Store(std::unique_ptr<Database> database, std::string notice);

  Outcome<Id, Failure> insert(const Binding& binding, State state, std::string_view json, std::string_view dataset,
                              std::string_view utc);

  std::unique_ptr<Database> database_;
  std::string notice_;
};

}  // namespace probebox::store
