#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "firmware/app/results/compared_values.hpp"
#include "firmware/app/results/cut_lock.hpp"
#include "firmware/app/results/machine_range.hpp"
#include "firmware/app/results/values_in_use.hpp"
#include "firmware/app/results/wall_clock.hpp"
#include "firmware/box/state.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "firmware/results/decide.hpp"
#include "firmware/store/store.hpp"
#include "protocol/events/event.hpp"
#include "protocol/state/served_results.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Probe, machine and mounting of a calibration, and the travel that its values have to lie within.
struct Mounting {
  std::string probe_serial_number;
  std::string machine;
  std::string mounting;
  MachineTravel travel{};
  bool has_y{true};
};

// Outcome of an acceptance.
struct Acceptance : store::Record {
  Comparison comparison;           // with the result that was in force before
  std::vector<std::string> notes;  // what a person should know about the effect
};

// Brings results into force and out of it. Each command is decided by the ledger (firmware/results), appended to the
// store, and posted to the core, in this order. For the worker's thread, except active(), isWaiting(), wasAccepted(),
// about(), records(), measuredFacts(), served(), storageProblems() and sensorHead(): any thread may call these.
class ResultsInForce {
 public:
  using ValidateActivation = std::function<std::optional<Error>(std::span<const Event>)>;
  using Accepted = Outcome<Acceptance, store::Failure>;
  struct Return {
    std::optional<store::Record> retired;  // was in force until now, or waited
    std::optional<store::Record> active;   // is in force again; empty: there was none before
    std::vector<std::string> notes;        // what a person should know about the effect
  };
  using RolledBack = Outcome<Return, store::Failure>;

  // validate_activation: explains why the core cannot apply the events of a result. post: passes an event to the core
  // and waits until it is taken. `store` outlives this.
  ResultsInForce(store::Store& store, Mounting mounting, std::function<MonoTime()> now,
                 ValidateActivation validate_activation, std::function<void(const Event&)> post);
  ResultsInForce(const ResultsInForce&) = delete;
  ResultsInForce& operator=(const ResultsInForce&) = delete;

  store::Binding bindingFor(const std::string& subject) const;
  // Explains why such a result may not come into force on this machine (machine_range.hpp); nothing when it may.
  std::optional<Error> validateRange(const metrology::Result& result) const;

  // Events for the start of the core: all results in force from earlier runs of the daemon.
  std::vector<Event> restore();

  // Handles the newest state of the core. Waiting results come into force as soon as no cut is on, in the name of the
  // persons who accepted them; not in the first second, when the levels of inhibit lines may still be unknown.
  void look(const box::State& state);
  // Adds guards for each result that comes into force. try_lock: whether a connection holds an inhibit that the core
  // may not know of yet; from this test until the core has the events, connections are kept from declaring a cut.
  // cut_seen: asked before the store is changed, and after that: a change during which a line rose is reverted.
  void setCutGuards(TryLockOutCuts try_lock, CutSeen cut_seen = {}) {
    try_lock_ = std::move(try_lock);
    cut_seen_ = std::move(cut_seen);
  }

  // The returned record is ACTIVE, or ACCEPTED while a cut is on. A result that differs from the one in force by more
  // than kMostSd is refused unless although_it_differs, and so is one that fails a limit.
  Accepted accept(store::Id id, const std::string& by, bool although_it_differs = false);
  // Returns what accept() would return; changes nothing.
  Accepted compareOnly(store::Id id);

  // Returns to the result that was in force before, about `subject` (or one of its methods), or about the subject of
  // result `id`, which must be in force. Refused during a cut, not deferred: at its end another result may be in force
  // than the one the person wanted to leave. Refused, too, when the one of before no longer fits. Rolling back a
  // waiting result withdraws it, which is always allowed.
  RolledBack rollBack(const std::string& subject, const std::string& by);
  RolledBack rollBack(store::Id id, const std::string& by);

  // Why this box, as it is described now, cannot have the result in force; nothing for one that is retired.
  std::optional<std::string> whyNotInForce(const store::Record& record) const;
  // Whether what rests on this result is to be measured again (results::isToRepeat).
  bool isToRepeat(store::Id rested_on) const;

  // Results in force that the core applies, without those that no longer fit the configuration.
  std::vector<std::uint64_t> active() const { return shown()->active; }
  bool isWaiting(store::Id id) const { return shown()->waiting.contains(id); }
  // True once somebody has accepted the result, since this process began. Any thread.
  bool wasAccepted(store::Id id) const;
  // The offset in force of the stylus that this tool carries. For the worker's thread.
  struct StylusOffset {
    store::Id id{};
    metrology::Estimate value;
  };
  std::optional<StylusOffset> stylusOffset(std::uint32_t probe_tool) const;
  // Reads what has been proposed, for served().
  void showProposed();
  // Results in force that the core applies or procedures use, by rising number. Any thread.
  std::vector<InForceAbout> about() const { return shown()->about; }
  // What is known of them, likewise.
  std::vector<std::shared_ptr<const store::Record>> records() const { return shown()->records; }
  MeasuredFacts measuredFacts() const { return shown()->facts; }
  // Their values, for registers; a new object after each change. Any thread.
  std::shared_ptr<const published::ServedResults> served() const { return shown()->served; }
  // One sentence for each result in force that rests on a retired one, or fails a limit, and for each that waits and no
  // longer fits.
  std::vector<std::string> toRepeat() const { return shown()->to_repeat; }
  // Problems of storing, and losses, with remedies; empty without any.
  std::vector<std::string> storageProblems() const { return shown()->storage_problems; }
  // The calibration in force of the sensor head with that tool number; nothing without one.
  std::optional<procedure::CalibratedHead> sensorHead(std::uint32_t tool) const;

 private:
  // What other threads see of the ledger; never changed once it is shown.
  struct Shown {
    std::vector<std::uint64_t> active;
    std::set<store::Id> waiting;
    std::vector<procedure::CalibratedHead> sensor_heads;
    std::vector<std::string> storage_problems;
    std::vector<std::string> to_repeat;
    std::vector<InForceAbout> about;
    std::vector<std::shared_ptr<const store::Record>> records;
    MeasuredFacts facts;
    std::shared_ptr<published::ServedResults> served{std::make_shared<published::ServedResults>()};
  };
  std::shared_ptr<const Shown> shown() const {
    const std::lock_guard lock{mutex_};
    return shown_;
  }
  // A command that was decided, and stored where it changes anything.
  struct Done {
    results::Decision decision;
    bool cut_was_on{};
    bool reverted{};  // a cut began before anybody was told
  };
  Outcome<Done, store::Failure> perform(const results::Command& command);
  Outcome<Done, store::Failure> decideAndStore(const results::Command& command, bool cut_is_on);
  void take(const results::Ledger& before, const std::optional<store::Proposal>& proposal,
            std::span<const store::Transition> stored);
  bool revertWhereCutBegan(const results::Ledger& before, const results::Decision& decision,
                           std::vector<store::Transition> stored);
  bool hasStates(std::span<const store::Change> changes, store::State store::Change::*state) const;
  store::Failure asTheStoreKnows(store::Id id, const store::Failure& failure);
  store::Failure failed(const store::Failure& failure, const results::Ledger& before,
                        const results::Decision& decision) const;
  void publishAndPost(const results::Ledger& before);
  void publish();
  void reload();
  std::optional<store::Failure> readNewer();

  results::Values values() const;
  std::shared_ptr<const store::Record> recordOf(store::Id id) const;
  std::vector<store::Id> unread() const;
  void forgetUnread(bool cut_is_on);
  void forgetOthers() const;
  Outcome<std::vector<Event>> fitActivation(const store::Record& record) const;
  Acceptance acceptance(store::Record record, const results::Decision& decision) const;
  store::Record asStored(store::Id id) const;
  RolledBack rolledBack(const results::Command& command);

  std::optional<CutLock> tryLockOutCuts() const;
  bool cutSeen() const { return cut_seen_ && cut_seen_(); }
  void activateWaiting();
  bool activate(store::Id waiting);
  void makeMissingSum();

  store::Store& store_;
  Mounting mounting_;
  std::function<MonoTime()> now_;
  ValidateActivation validate_activation_;
  std::function<void(const Event&)> post_;
  results::Ledger ledger_;
  results::Values values_;
  mutable std::map<store::Id, std::shared_ptr<const store::Record>> records_;  // null: unreadable
  std::optional<MonoTime> first_state_at_;
  MonoTime state_at_{};
  MonoTime retry_not_before_{};  // after a failure of the store
  bool inhibited_{true};
  TryLockOutCuts try_lock_;
  CutSeen cut_seen_;
  bool sum_looked_for_{};              // since the start
  std::set<store::Id> waiting_unfit_;  // of those that wait
  mutable std::mutex mutex_;
  std::set<store::Id> once_accepted_;
  std::shared_ptr<const Shown> shown_{std::make_shared<const Shown>()};
};

}  // namespace probebox::app
