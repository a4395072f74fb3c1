#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "firmware/app/results/compared_values.hpp"
#include "firmware/app/results/machine_range.hpp"
#include "firmware/app/results/no_cut.hpp"
#include "firmware/app/results/values_in_use.hpp"
#include "firmware/app/results/wall_clock.hpp"
#include "firmware/box/state.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
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
};

// Outcome of an acceptance.
struct Acceptance : store::Record {
  Comparison comparison;           // with the result that was in force before
  std::vector<std::string> notes;  // what a person should know about the effect
};

// Manages the results in force: acceptance, waiting for the end of a cut, rollback. Each change is stored before the
// core is told. For the worker's thread, except active(), isWaiting(), wasAccepted(), about(), measuredFacts(),
// served(), storageProblems() and sensorHead(): any thread may call these.
class ResultsInForce {
 public:
  using WhyUnfit = std::function<std::optional<Error>(std::span<const Event>)>;
  using Accepted = Outcome<Acceptance, store::Failure>;
  struct Return : store::RolledBack {
    std::vector<std::string> notes;  // what a person should know about the effect
  };
  using RolledBack = Outcome<Return, store::Failure>;

  // why_unfit: explains why the core cannot apply the events of a result. tell_core: passes an event to the core and
  // waits until it is taken. `store` outlives this.
  ResultsInForce(store::Store& store, Mounting mounting, std::function<MonoTime()> now, WhyUnfit why_unfit,
                 std::function<void(const Event&)> tell_core);

  store::Binding bindingFor(const std::string& subject) const;
  // Explains why such a result may not come into force on this machine (machine_range.hpp); nothing when it may.
  std::optional<Error> whyOutside(const metrology::Result& result) const;

  // Events for the start of the core: all results in force from earlier runs of the daemon.
  std::vector<Event> restore();

  // Handles the newest state of the core. Waiting results come into force as soon as no cut is on, in the name of the
  // persons who accepted them; not in the first second, when the levels of inhibit lines may still be unknown.
  void look(const box::State& state);
  // Adds tests for each result that comes into force. keep_cuts_out: whether a door holds an inhibit that the core may
  // not know of yet; from this test until the core has been told, the doors are kept from declaring a cut. cut_seen:
  // asked before the store is changed, and after that: a change during which a line rose is taken back.
  void alsoAsk(KeepCutsOut keep_cuts_out, CutSeen cut_seen = {}) {
    keep_cuts_out_ = std::move(keep_cuts_out);
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

  // Results in force that the core applies, without those that no longer fit the configuration.
  std::vector<std::uint64_t> active() const;
  bool isWaiting(store::Id id) const;
  // True once somebody has accepted the result, since this process began. Any thread.
  bool wasAccepted(store::Id id) const;
  // The offset in force of the stylus that this tool carries. For the worker's thread.
  struct StylusOffset {
    store::Id id{};
    metrology::Estimate value;
  };
  std::optional<StylusOffset> stylusOffset(std::uint32_t probe_tool) const;
  // Results in force that the core applies or procedures use, by rising number. Any thread.
  std::vector<InForceAbout> about() const;
  MeasuredFacts measuredFacts() const;
  // Their values, for registers; a new object after each change. Any thread.
  std::shared_ptr<const published::ServedResults> served() const;
  // One sentence for each result in force that rests on a retired one, or fails a limit, and for each that waits and no
  // longer fits.
  std::vector<std::string> toRepeat() const;
  // Problems of storing, and losses, with remedies; empty without any.
  std::vector<std::string> storageProblems() const;
  // The calibration in force of the sensor head with that tool number; nothing without one.
  std::optional<procedure::CalibratedHead> sensorHead(std::uint32_t tool) const;

 private:
  std::optional<NoCut> noCut() const;
  bool cutSeen() const { return cut_seen_ && cut_seen_(); }
  bool tookBack(const std::vector<store::Record>& as_before);
  bool waitsAgain(store::Record& active, const std::optional<store::Record>& before);
  std::optional<store::Record> inForceAbout(const store::Binding& binding) const;
  std::vector<std::uint64_t> waiting() const;
  Outcome<std::vector<Event>> fitActivation(const store::Record& record) const;
  void tell(const store::Record& record);
  void tellNone(const std::string& subject);
  std::optional<Event> delayByAxis() const;
  std::uint64_t activatedBy(store::Id id) const;
  Acceptance comparedWithPresent(const store::Record& record) const;
  std::vector<std::string> notesOn(const store::Record& record) const;
  std::optional<std::string> aboutOtherAxes(const store::Record& record) const;
  std::vector<std::string> dependantsOn(store::Id retired) const;
  std::optional<store::Failure> whyBeside(const std::string& subject) const;
  std::optional<store::Failure> whyNoPlace(const std::string& subject) const;
  // A centreline from a tip and the offset of that tip, both in force.
  struct SumParts {
    store::Record from_tip;
    StylusOffset offset;
    store::Transition together;  // of the one that came into force later
  };
  std::optional<SumParts> sumParts() const;
  std::optional<std::string> deriveCentreline(const store::Record& accepted, const std::string& by);
  std::optional<std::string> deriveCentreline(const SumParts& parts, const std::string& by);
  void deriveMissingCentreline();
  // The proposal of their sum, and the last change of what is in force or waits about the turning axis; 0: none.
  struct SumBefore {
    store::Id sum{};
    std::uint64_t proposed{};
    std::uint64_t decided{};
  };
  std::optional<SumBefore> sumBefore(const SumParts& parts) const;
  bool turningAxisIsFree() const;
  std::string bringIntoForce(store::Id sum, const std::string& what, const std::string& by);
  std::vector<store::Id> basisOf(store::Id from_tip, store::Id offset) const;
  std::optional<store::Failure> otherBinding(const store::Record& record) const;
  std::optional<store::Failure> objectionTo(const store::Record& record) const;
  void activateWaiting();
  bool activate(store::Id waiting);
  std::optional<std::vector<store::Record>> ours(store::State state) const;
  void readStore();
  void catchUp();
  RolledBack rollBack(const store::Binding& binding, const std::string& by);

  store::Store& store_;
  Mounting mounting_;
  std::function<MonoTime()> now_;
  WhyUnfit why_unfit_;
  std::function<void(const Event&)> tell_core_;
  std::optional<MonoTime> first_state_at_;
  MonoTime state_at_{};
  MonoTime patient_until_{};  // no new attempt before, after a failure of the store
  bool inhibited_{true};
  KeepCutsOut keep_cuts_out_;
  CutSeen cut_seen_;
  bool sum_looked_for_{};              // since the start
  std::set<store::Id> waiting_unfit_;  // of those that wait; as of the last reading of the store
  mutable std::mutex mutex_;
  std::vector<std::uint64_t> active_;
  std::vector<std::uint64_t> waiting_;
  std::set<store::Id> once_accepted_;
  std::vector<procedure::CalibratedHead> sensor_heads_;
  std::vector<std::string> storage_problems_;
  std::vector<std::string> to_repeat_;
  std::vector<InForceAbout> about_;
  MeasuredFacts measured_facts_;
  std::shared_ptr<const published::ServedResults> served_{std::make_shared<published::ServedResults>()};
};

}  // namespace probebox::app
