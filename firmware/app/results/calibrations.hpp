#pragma once
#include <cstdint>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "firmware/app/results/results_in_force.hpp"
#include "firmware/app/results/standing_keeper.hpp"
#include "firmware/metrology/solve.hpp"
#include "firmware/procedure/dataset/run_dataset.hpp"
#include "firmware/store/store.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Solves recorded runs, keeps the results, and all that comes of them later. Lives on the worker's thread, except for
// lastRefusal(), factsNow() and what ResultsInForce allows, which any thread may ask.
class Calibrations {
 public:
  // `tell_core` hands a command to the core; false when its queue is full.
  using TellCore = std::function<bool(const Event&)>;
  Calibrations(store::Store store, Mounting mounting, procedure::Facts facts, std::function<MonoTime()> now,
               ResultsInForce::WhyUnfit why_unfit, TellCore tell_core);

  // What the core must hear before anything else: the correction that stands, then the results in force.
  std::vector<Event> restore();
  // What the core says now; called again and again. finish(): for the last time.
  void look(const box::State& state);
  void finish(const box::State& state) { standing_.finish(state.snapshot); }

  // A calibration is stored and proposed; what a selftest finds is answered alone.
  void solve(std::uint32_t run, procedure::Method method, const capture::Recording& recording,
             const capture::Scales& scales);
  // Solves a case that was measured without the box, and keeps what comes of it. A case that says of which probe,
  // machine or mounting it is must mean those that the box describes.
  struct Proposed {
    store::Id id{};
    std::string refusal;  // name, colon and reason; empty where there is a result
  };
  Outcome<Proposed> propose(metrology::Dataset dataset);
  // As described, and what calibrations in force add to that. Any thread may ask.
  procedure::Facts factsNow() const;
  ResultsInForce& inForce() { return in_force_; }
  const ResultsInForce& inForce() const { return in_force_; }
  Outcome<std::vector<store::Record>, store::Failure> newest(std::size_t count) { return store_.newest(count); }
  Outcome<std::vector<store::Transition>, store::Failure> history(const store::HistoryRange& range) {
    return store_.history(range);
  }
  // The data of a run of this process, as JSON text; empty when there is none.
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
  StandingKeeper standing_{store_};
  std::uint32_t dataset_run_{};
  std::string dataset_;
  mutable std::mutex mutex_;
  std::string last_refusal_;
};

}  // namespace probebox::app
