#pragma once
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/store/failure.hpp"
#include "firmware/store/record.hpp"
#include "firmware/store/set_aside.hpp"
#include "protocol/units/outcome.hpp"

// Keeps results of calibrations and the transitions of their states in one SQLite file. A solver PROPOSES a result, a
// person ACCEPTS it, it becomes ACTIVE when no cut is in progress, and is RETIRED when the next one replaces it: what
// may become what is decided by firmware/results. Refusals are kept too. Acknowledged calls survive a killed process
// and a power failure. For one thread; the caller supplies the time.
namespace probebox::store {

class Database;

class Store {
 public:
  // Number of datasets kept for results that were never accepted, and their characters, of which the newest may have
  // more. Datasets of accepted results are all kept.
  static constexpr std::size_t kOtherDatasets = 20, kOtherDatasetsCharacters = 32'000'000;

  // Makes the file when it is missing, and checks every page and row. A file that is damaged, empty or of another
  // program is moved aside, never deleted; its intact rows are copied, and notice() reports it. Refuses, without
  // changing the file: another schema, a read-only, unreadable or locked file, a full disk, what is no ordinary file.
  static Outcome<Store, Failure> open(const std::string& path);

  // The same, but where open() refuses, returns a read-only store with everything readable of the file; nothing of one
  // of another schema. Every change is then refused with the reason in whyNotWritable(). notice() reports a file that
  // is gone.
  static Store openAnyhow(const std::string& path, Before before = Before::perhaps);

  Store(Store&&) noexcept;
  Store& operator=(Store&&) noexcept;
  ~Store();

  // Message about the opening for a person; empty when it succeeded without one.
  const std::string& notice() const { return notice_; }
  // Reason why nothing can be stored; empty when it can.
  const std::string& whyNotWritable() const;
  // One sentence with its remedy for each damaged or lost result, until a later one has replaced it.
  std::vector<std::string> damage();

  // dataset: the measured data as JSON, for `calibrate --save`; may be empty. utc: present time, ISO 8601.
  Outcome<Id, Failure> propose(const Binding& binding, const metrology::Result& result, std::string_view dataset,
                               std::string_view utc, const Origin& origin = {});
  // The same of a case about several subjects: all of them in one transaction, or none.
  Outcome<std::vector<Id>, Failure> propose(std::span<const Proposal> proposals, std::string_view dataset,
                                            std::string_view utc);
  Outcome<Id, Failure> refuse(const Binding& binding, std::string_view method, const metrology::Refusal& refusal,
                              std::string_view dataset, std::string_view utc);

  // Stores these changes of state in their order, and before them the proposal if there is one, in one transaction.
  // Returns them with their numbers. next_id: the number that the changes give to the proposal (Contents::next_id).
  // Refuses where a result is not in the state that a change begins with, or where the proposal gets another number.
  Outcome<std::vector<Transition>, Failure> append(std::span<const Change> changes,
                                                   const std::optional<Proposal>& proposal, Id next_id,
                                                   std::string_view utc);

  // Deletes the newest transition of each of these results, which is that of the change, in one transaction: as though
  // it had never been made. For changes that nobody has been told of. The one that came into force comes first.
  Outcome<void, Failure> undo(std::span<const Change> changes);

  // All results above this number, refusals included, with their transitions; damaged rows are set aside.
  Outcome<Contents, Failure> load(Id after = 0);

  Outcome<Record, Failure> find(Id id);
  // Results by rising id, at most `count` with an id above `after`, without refusals.
  Outcome<std::vector<Record>, Failure> resultsAfter(Id after, std::size_t count);
  // The greatest id below the newest `count` results, refusals not counted; 0 when there are fewer.
  Outcome<Id, Failure> idBeforeNewest(std::size_t count);
  Outcome<std::string, Failure> dataset(Id id);              // empty: none was given, or it was dropped
  Outcome<std::vector<Transition>, Failure> history(Id id);  // in the order in which it happened
  Outcome<std::vector<Transition>, Failure> history(const HistoryRange& range);
  // By rising id.
  Outcome<std::vector<Dependence>, Failure> restsOn(Id id);

 private:
  Store(std::unique_ptr<Database> database, std::string notice);

  bool setDamagedRowsAside();

  // Repeats `act` once if a damaged row made it fail and can be set aside.
  template <class Act>
  auto withoutDamage(const Act& act) {
    auto done = act();
    if (!done && done.error().reason == Reason::damaged && setDamagedRowsAside()) done = act();
    return done;
  }

  struct Content {
    State state;
    std::string_view method;
    std::string_view json;
    std::string_view dataset;
  };
  // Within a transaction of the caller's. Returns the transition.
  Outcome<Transition, Failure> insert(const Binding& binding, const Content& content, std::string_view utc,
                                      const Origin& origin);
  Outcome<Transition, Failure> change(const Change& change, std::string_view utc);

  std::unique_ptr<Database> database_;
  std::string notice_;
};

}  // namespace probebox::store
