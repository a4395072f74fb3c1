#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/app/results/compared_values.hpp"
#include "firmware/app/results/machine_range.hpp"
#include "firmware/app/results/values_in_use.hpp"
#include "firmware/box/state.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "firmware/published/served_results.hpp"
#include "firmware/store/store.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// What a calibration belongs to, and the travel that its values have to lie within.
struct Mounting {
  std::string probe_serial_number;
  std::string machine;
  std::string mounting;
  MachineTravel travel{};
};

// Now, ISO 8601.
std::string utcNow();

// What comes of an acceptance.
struct Acceptance : store::Record {
  Comparison comparison;           // with what was in force before
  std::vector<std::string> notes;  // what a person should know about the effect
};

// Which results are in force: acceptance, waiting for the end of a cut, going back. Whatever changes is in the store
// before the core hears of it. Lives on the worker's thread, except for active(), isWaiting(), sensorHead()
// and storageProblems(), which any thread may ask.
class ResultsInForce {
 public:
  using WhyUnfit = std::function<std::optional<Error>(std::span<const Event>)>;
  using Accepted = Outcome<Acceptance, store::Failure>;
  using RolledBack = Outcome<store::RolledBack, store::Failure>;

  // `why_unfit` says what keeps the core from following the events of a result. `tell_core` hands one to it, however
  // long that takes. `store` outlives this.
  ResultsInForce(store::Store& store, Mounting mounting, std::function<MonoTime()> now, WhyUnfit why_unfit,
                 std::function<void(const Event&)> tell_core);

  store::Binding bindingFor(const std::string& subject) const;
  // Why no result like this may come into force on this machine (machine_range.hpp); nothing when it may.
  std::optional<Error> whyOutside(const metrology::Result& result) const;

  // What the core must hear at its start: all results in force from earlier runs of the daemon.
  std::vector<Event> restore();

  // What the core says now. Results that wait come into force as soon as no cut is on, in the name of those who
  // accepted them. The first second tells nothing: the levels of the inhibit lines may not be known yet.
  void look(const box::State& state);
  // Asked besides: whether a door holds an inhibit that the core may not have heard of yet.
  void alsoAsk(std::function<bool()> cut_is_held) { cut_is_held_ = std::move(cut_is_held); }

  // The record is ACTIVE when nothing forbids it, and ACCEPTED while a cut is on. A result that differs from the one in
  // force by more than kMostSd is refused unless the person says that he knows.
  Accepted accept(store::Id id, const std::string& by, bool although_it_differs = false);
  // What accept() would answer; changes nothing.
  Accepted compareOnly(store::Id id);

  // Goes back to what was in force before, about `subject` (or a method that answers it), or about the subject of the
  // result `id`, which must be in force. While a cut is on it is refused, and does not wait: a person goes back from
  // what is in force now, and by the end of the cut that may be something else. To go back from a result that only
  // waits withdraws it; that changes nothing in force and is allowed at any time.
  RolledBack rollBack(const std::string& subject, const std::string& by);
  RolledBack rollBack(store::Id id, const std::string& by);

  // Those in force that the core follows: what fitted once and does not fit any more is not among them.
  std::vector<std::uint64_t> active() const;
  bool isWaiting(store::Id id) const;
  // The offset in force of the stylus that this tool carries. On the worker's thread.
  struct StylusOffset {
    store::Id id{};
    metrology::Estimate value;
  };
  std::optional<StylusOffset> stylusOffset(std::uint32_t probe_tool) const;
  // What is in force that the core follows or procedures use, by rising number. Any thread may ask.
  std::vector<InForceAbout> about() const;
  MeasuredFacts measuredFacts() const;
  // Their values, for registers. Another object whenever one has changed. Any thread may ask.
  std::shared_ptr<const published::ServedResults> served() const;
  // A sentence for each result in force that rests on a retired one.
  std::vector<std::string> restsOnRetired() const;
  // What cannot be stored, or was lost, and what to do about it; empty when all is well.
  std::vector<std::string> storageProblems() const;
  // What the calibration of the sensor head with that tool number found; nothing while none is in force.
  std::optional<procedure::CalibratedHead> sensorHead(std::uint32_t tool) const;

 private:
  bool mayChange() const;
  std::vector<std::uint64_t> waiting() const;
  Outcome<std::vector<Event>> fitActivation(const store::Record& record) const;
  void tell(const store::Record& record);
  Acceptance comparedWithPresent(const store::Record& record) const;
  std::vector<std::string> notesOn(const store::Record& record) const;
  std::vector<std::string> dependantsOn(store::Id retired) const;
  std::optional<store::Failure> whyBeside(const std::string& subject) const;
  std::optional<std::string> deriveCentreline(const store::Record& accepted, const std::string& by);
  bool isDerived(const store::Binding& binding, store::Id from_tip, store::Id offset) const;
  std::optional<store::Failure> otherBinding(const store::Record& record) const;
  std::optional<store::Failure> objectionTo(const store::Record& record) const;
  void activateWaiting();
  std::optional<std::vector<store::Record>> ours(store::State state) const;
  void readStore();
  RolledBack rollBack(const store::Binding& binding, const std::string& by);

  store::Store& store_;
  Mounting mounting_;
  std::function<MonoTime()> now_;
  WhyUnfit why_unfit_;
  std::function<void(const Event&)> tell_core_;
  std::optional<MonoTime> first_state_at_;
  MonoTime state_at_{};
  MonoTime patient_until_{};  // after a failure of the store
  bool inhibited_{true};
  std::function<bool()> cut_is_held_;
  mutable std::mutex mutex_;
  std::vector<std::uint64_t> active_;
  std::vector<std::uint64_t> waiting_;
  std::vector<procedure::CalibratedHead> sensor_heads_;
  std::vector<std::string> storage_problems_;
  std::vector<std::string> rests_on_retired_;
  std::vector<InForceAbout> about_;
  MeasuredFacts measured_facts_;
  std::shared_ptr<const published::ServedResults> served_{std::make_shared<published::ServedResults>()};
};

}  // namespace probebox::app
