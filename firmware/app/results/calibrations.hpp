#pragma once
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "firmware/app/results/results_in_force.hpp"
#include "firmware/metrology/solve.hpp"
#include "firmware/procedure/dataset/run_dataset.hpp"
#include "firmware/store/store.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Solves recorded runs, stores the results and manages their life. Lives on the worker's thread, except for
// lastRefusal(), factsNow() and the functions of ResultsInForce that any thread may call.
class Calibrations {
 public:
  // `tell_core` hands a command to the core; false when its queue is full.
  using TellCore = std::function<bool(const Event&)>;
  Calibrations(store::Store store, Mounting mounting, procedure::Facts facts, std::function<MonoTime()> now,
               ResultsInForce::WhyUnfit why_unfit, TellCore tell_core);

  // What the core must hear before anything else: the results in force.
  std::vector<Event> restore() { return in_force_.restore(); }
  // What the core says now; called again and again.
  void look(const box::State& state) { in_force_.look(state); }
  // The correction that an earlier version kept in the store; StandingKeeper has it now.
  std::optional<store::Standing> standingOfBefore();

  // Stores and proposes the result of a calibration; the findings of a selftest are only answered.
  void solve(std::uint32_t run, procedure::Method method, const capture::Recording& recording,
             const capture::Scales& scales);
  // Solves a case that was measured without the box, and stores the outcome. A case that names its probe, machine or
  // mounting must match the descriptions.
  struct Proposed {
    store::Id id{};
    std::string refusal;  // name, colon and reason; empty if there is a result
  };
  Outcome<Proposed> propose(metrology::Dataset dataset);
  // Facts from the descriptions and from calibrations in force. Any thread.
  procedure::Facts factsNow() const;
  ResultsInForce& inForce() { return in_force_; }
  const ResultsInForce& inForce() const { return in_force_; }
  // By rising id, at most `count` above `after`; with `newest` none but the newest so many.
  Outcome<std::vector<store::Record>, store::Failure> results(store::Id after, std::size_t count, std::size_t newest);
  Outcome<std::vector<store::Transition>, store::Failure> history(const store::HistoryRange& range) {
    return store_.history(range);
  }
  // Data of a run of this process as JSON; empty when there are none.
  const std::string& dataset(std::uint32_t run) const;

  std::string lastRefusal() const;

 private:
  Outcome<store::Id, store::Failure> stored(const metrology::Dataset& dataset, const metrology::Solved& solved,
                                            const std::string& text);
  std::optional<store::Id> keep(const metrology::Dataset& dataset, const metrology::Solved& solved);
  void setRefusal(const std::string& text);
  void insist(const Event& command);

  store::Store store_;
  procedure::Facts facts_;
  std::function<MonoTime()> now_;
  TellCore tell_core_;
  ResultsInForce in_force_;
  std::uint32_t dataset_run_{};
  std::string dataset_;
  mutable std::mutex mutex_;
  std::string last_refusal_;
};

}  // namespace probebox::app
