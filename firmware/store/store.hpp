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

// Keeps results of calibrations in one SQLite file. A solver PROPOSES a result, a person ACCEPTS it, it becomes ACTIVE
// when no cut is in progress, and is RETIRED when the next one replaces it. Refusals are kept too. Acknowledged calls
// survive a killed process and a power failure. For one thread; the caller supplies the time.
namespace probebox::store {

// Whether an accepted result comes into force at once or waits for activate().
enum class Activation : std::uint8_t { at_once, later };

// The changes of a rollback; at least one is set.
struct RolledBack {
  std::optional<Record> retired;  // was in force until now
  std::optional<Record> active;   // is in force again; empty: there was none before
};

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

  // Accepts a proposed result, and activates it unless told to wait. Replaces the active or waiting result of the same
  // binding in one transaction. Accepting an accepted or active result changes nothing and returns its record; an
  // active one is refused while another waits to take its place. remark: kept in its history.
  Outcome<Record, Failure> accept(Id id, std::string_view by, std::string_view utc,
                                  Activation activation = Activation::at_once, std::string_view remark = {});

  // Activates an accepted result in the name of the person who accepted it, and retires the active one.
  Outcome<Record, Failure> activate(Id id, std::string_view utc);

  // Undoes the last change in force for the binding: retires the active result, if any, and reactivates the one that
  // was retired last. A second rollback undoes the first.
  Outcome<RolledBack, Failure> rollBack(const Binding& binding, std::string_view by, std::string_view utc);

  // The result that a rollback for the binding would bring back into force: the last retired one that ever was.
  Outcome<std::optional<Record>, Failure> retiredLast(const Binding& binding);

  // Retires an accepted result that still waits.
  Outcome<Record, Failure> withdraw(Id id, std::string_view by, std::string_view utc);

  // Undoes the newest change of each of these results in one transaction, as though it had never been made: state and
  // retired_utc are those of these records, and the history loses the transition. For a change that nobody has been
  // told of. The one that leaves force comes first.
  Outcome<void, Failure> takeBack(std::span<const Record> as_before);

  Outcome<Record, Failure> find(Id id);
  Outcome<std::optional<Record>, Failure> active(const Binding& binding);
  Outcome<std::vector<Record>, Failure> inState(State state);       // oldest first
  Outcome<std::vector<Record>, Failure> newest(std::size_t count);  // newest first, every state
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

  Outcome<Record, Failure> acceptNow(Id id, std::string_view by, std::string_view utc, Activation activation,
                                     std::string_view remark);
  Outcome<Record, Failure> activateNow(Id id, std::string_view utc);
  Outcome<RolledBack, Failure> rollBackNow(const Binding& binding, std::string_view by, std::string_view utc);
  Outcome<std::optional<Record>, Failure> retiredLastNow(const Binding& binding);
  Outcome<Record, Failure> withdrawNow(Id id, std::string_view by, std::string_view utc);
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
  // Within a transaction of the caller's.
  Outcome<Id, Failure> insert(const Binding& binding, const Content& content, std::string_view utc,
                              const Origin& origin);

  std::unique_ptr<Database> database_;
  std::string notice_;
};

}  // namespace probebox::store
