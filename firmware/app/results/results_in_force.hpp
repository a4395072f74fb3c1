#pragma once
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/box/state.hpp"
#include "firmware/procedure/dataset/run_dataset.hpp"
#include "firmware/store/store.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Probe, machine and mounting that calibrations are bound to.
struct Mounting {
  std::string probe_serial_number;
  std::string machine;
  std::string mounting;
};

// Present time, ISO 8601.
std::string utcNow();

// Which results are in force: acceptance, waiting for the end of a cut, going back. Whatever changes is in the store
// before the core hears of it. Lives on the worker's thread, except for active(), isWaiting(), sensorHead()
// and storageProblems(), which any thread may ask.
class ResultsInForce {
 public:
  using WhyUnfit = std::function<std::optional<Error>(std::span<const Event>)>;
  using Accepted = Outcome<store::Record, store::Failure>;
  using RolledBack = Outcome<store::RolledBack, store::Failure>;

  // `why_unfit`: why the core cannot apply the events of a result. `tell_core`: delivers an event to the core, however
  // long that takes. `store` must outlive this.
  ResultsInForce(store::Store& store, Mounting mounting, std::function<MonoTime()> now, WhyUnfit why_unfit,
                 std::function<void(const Event&)> tell_core);

  store::Binding bindingFor(const std::string& subject) const;

  // Events for the start of the core: all results in force from earlier runs of the daemon.
  std::vector<Event> restore();

  // Takes the newest state of the core. Activates waiting results when no cut is in progress, in the name of those who
  // accepted them. Ignores the first second, when the inhibit lines may be unknown.
  void look(const box::State& state);

  // Returns the record: ACTIVE, or ACCEPTED during a cut.
  Accepted accept(store::Id id, const std::string& by);

  // Returns to the previous result about `subject` (or one of its methods), or about the subject of result `id`, which
  // must be in force. Refused during a cut, without waiting: it refers to what is in force now. For a result that only
  // waits it is a withdrawal, which is allowed at any time.
  RolledBack rollBack(const std::string& subject, const std::string& by);
  RolledBack rollBack(store::Id id, const std::string& by);

  // Results in force that the core applies, without those that no longer fit the descriptions.
  std::vector<std::uint64_t> active() const;
  bool isWaiting(store::Id id) const;
  // What cannot be stored, or was lost, and what to do about it; empty when all is well.
  std::vector<std::string> storageProblems() const;
  // Calibration of the sensor head with this tool number; nullopt when none is in force.
  std::optional<procedure::CalibratedHead> sensorHead(std::uint32_t tool) const;

 private:
  bool mayChange() const;
  std::vector<std::uint64_t> waiting() const;
  Outcome<std::vector<Event>> fitActivation(const store::Record& record) const;
  void tell(const store::Record& record);
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
  mutable std::mutex mutex_;
  std::vector<std::uint64_t> active_;
  std::vector<std::uint64_t> waiting_;
  std::vector<procedure::CalibratedHead> sensor_heads_;
  std::vector<std::string> storage_problems_;
};

}  // namespace probebox::app
