#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/store/failure.hpp"
#include "firmware/store/record.hpp"
#include "protocol/units/outcome.hpp"

// Results of calibrations in one SQLite file. A result is PROPOSED by the solver, ACCEPTED by a person, ACTIVE as soon
// as the machine allows, and RETIRED when the next one takes its place; a refusal is kept too. What a call has
// acknowledged survives a killed process and a pulled plug. One thread; time is given by the caller.
namespace probebox::store {

// Whether what a person has accepted may come into force at once, or waits for activate().
enum class Activation : std::uint8_t { at_once, later };

// What a rollback has changed; both empty is not possible.
struct RolledBack {
  std::optional<Record> retired;  // was in force until now
  std::optional<Record> active;   // is in force again; empty: there was none before
};

// The correction that was served last, mm, machine axes X Y Z, radius.
struct Standing {
  std::array<double, 3> correction_mm{};
  std::string utc;
};

class Database;

class Store {
 public:
  // How many measured datasets stay of results that nobody has ever accepted. Those of accepted ones all stay.
  static constexpr std::size_t kOtherDatasets = 20;

  // Makes the file when it is missing, brings an older one to the newest schema, and checks every page. A damaged file
  // is moved aside, never deleted: notice() then says where to. A newer schema, another program's file, a read-only,
  // unreadable or locked file and a full disk are refused by name, and the file is left as it is.
  static Outcome<Store, Failure> open(const std::string& path);

  Store(Store&&) noexcept;
  Store& operator=(Store&&) noexcept;
  ~Store();

  // What a person must know about the opening; empty when all was well.
  const std::string& notice() const { return notice_; }

  // dataset: what was measured, as text, for `calibrate --save`; may be empty. utc: now, ISO 8601.
  Outcome<Id, Failure> propose(const Binding& binding, const metrology::Result& result, std::string_view dataset,
                               std::string_view utc);
  Outcome<Id, Failure> refuse(const Binding& binding, std::string_view method, const metrology::Refusal& refusal,
                              std::string_view dataset, std::string_view utc);

  // Accepts a proposed result, and activates it unless told to wait. Whatever of the same binding was active or waiting
  // gives way, all or nothing. To accept a result again that is accepted or active already changes nothing and gives
  // the record as it stands.
  Outcome<Record, Failure> accept(Id id, std::string_view by, std::string_view utc,
                                  Activation activation = Activation::at_once);

  // Activates an accepted result, in the name of the person who accepted it, and retires the one that was active.
  Outcome<Record, Failure> activate(Id id, std::string_view utc);

  // Undoes the last change of what is in force for the binding: the active result, if there is one, is retired, and the
  // one that was retired last becomes active again. A second rollback therefore undoes the first.
  Outcome<RolledBack, Failure> rollBack(const Binding& binding, std::string_view by, std::string_view utc);

  // Retires an accepted result that still waits: it will not come into force.
  Outcome<Record, Failure> withdraw(Id id, std::string_view by, std::string_view utc);

  Outcome<Record, Failure> find(Id id);
  Outcome<std::optional<Record>, Failure> active(const Binding& binding);
  Outcome<std::vector<Record>, Failure> inState(State state);       // oldest first
  Outcome<std::vector<Record>, Failure> newest(std::size_t count);  // newest first, every state
  Outcome<std::string, Failure> dataset(Id id);                     // empty: none came, or it was dropped
  Outcome<std::vector<Transition>, Failure> history(Id id);         // in the order in which it happened
  Outcome<std::vector<Transition>, Failure> history(const HistoryRange& range);

  Outcome<Standing, Failure> keepStanding(const std::array<double, 3>& correction_mm, std::string_view utc);
  Outcome<std::optional<Standing>, Failure> standing();

 private:
  Store(std::unique_ptr<Database> database, std::string notice);

  struct Content {
    State state;
    std::string_view method;
    std::string_view json;
    std::string_view dataset;
  };
  Outcome<Id, Failure> insert(const Binding& binding, const Content& content, std::string_view utc);

  std::unique_ptr<Database> database_;
  std::string notice_;
};

}  // namespace probebox::store
