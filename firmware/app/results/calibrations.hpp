#pragma once
#include <chrono>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "firmware/app/results/results_in_force.hpp"
#include "firmware/app/results/values_in_use.hpp"
#include "firmware/app/solver/solver_process.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/metrology/solve.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "firmware/store/store.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Solves recorded runs, keeps the results, and all that comes of them later. Lives on the worker's thread, except for
// lastRefusal(), factsNow() and what ResultsInForce allows, which any thread may ask.
class Calibrations {
 public:
  // `tell_core` hands a command to the core; false when its queue is full. `solver`: the program that solves cases
  // (SolverProcess).
  using TellCore = std::function<bool(const Event&)>;
  Calibrations(store::Store store, Mounting mounting, procedure::Facts facts, std::function<MonoTime()> now,
               ResultsInForce::WhyUnfit why_unfit, TellCore tell_core, std::filesystem::path solver = {});

  // What the core must hear before anything else: the results in force.
  std::vector<Event> restore() { return in_force_.restore(); }
  // What the core says now, and what the solver has answered; called again and again.
  void look(const box::State& state);
  // The correction that an earlier version kept in the store; StandingKeeper has it now.
  std::optional<store::Standing> standingOfBefore();
  // Readable when the solver has something for look(); -1 while nothing is being solved.
  int solverDescriptor() const { return solver_.descriptor(); }
  // The end of the daemon: waits for a run that is being solved, then keeps the data of one that is not as a refusal.
  void finishSolving(std::chrono::milliseconds at_most);

  // A calibration is stored and proposed; what a selftest finds is answered alone.
  void solve(std::uint32_t run, const procedure::LiveMethod& method, const capture::Recording& recording,
             const capture::Scales& scales);
  // Solves a case that was measured without the box, keeps what comes of it, and then says so: now, or in a later
  // look(). A case that says of which probe, machine or mounting it is must mean those that the box describes. One at a
  // time.
  struct Proposed {
    store::Id id{};
    std::string refusal;          // name, colon and reason; empty where there is a result
    std::vector<store::Id> also;  // of further subjects
  };
  using Answered = std::function<void(Outcome<Proposed>)>;
  // A case that does not name probe, machine and mounting needs somebody who says that they are those of this box:
  // as_this_machine_by; empty: nobody does.
  void propose(metrology::Dataset dataset, const std::string& as_this_machine_by, Answered then);
  // Beside its record: what it rests on, and who said that it is of this machine.
  Outcome<std::vector<store::Dependence>, store::Failure> restsOn(store::Id id) { return store_.restsOn(id); }
  std::string adoptedBy(store::Id id);
  bool isProposing() const;
  // Gives the proposed case up: nothing is stored, and nobody is told.
  void cancelProposal();
  // As described, and what calibrations in force add to that. Any thread may ask.
  procedure::Facts factsNow() const;
  // Values in use and where they come from. Any thread may ask.
  std::vector<messages::ValueInUse> valuesInUse() const { return app::valuesInUse(facts_, in_force_.about()); }
  ResultsInForce& inForce() { return in_force_; }
  const ResultsInForce& inForce() const { return in_force_; }
  // By rising id, at most `count` above `after`; with `newest` none but the newest so many.
  Outcome<std::vector<store::Record>, store::Failure> results(store::Id after, std::size_t count, std::size_t newest);
  Outcome<std::vector<store::Transition>, store::Failure> history(const store::HistoryRange& range) {
    return store_.history(range);
  }
  Outcome<store::Record, store::Failure> find(store::Id id) { return store_.find(id); }
  // The measured data of a result, as JSON text; empty when they are not kept.
  Outcome<std::string, store::Failure> datasetOf(store::Id id) { return store_.dataset(id); }
  // The data of a run of this process, as JSON text; empty when there is none.
  const std::string& dataset(std::uint32_t run) const;

  std::string lastRefusal() const;

 private:
  // A case on its way through the solver. A live run waits for nobody; a proposal can be given up.
  struct Case {
    std::vector<metrology::NamedSubject> subjects;
    store::Origin origin;
    std::string method;
    std::shared_ptr<const std::string> text;  // as it is solved and stored
    bool proposed{};
    std::function<void(const metrology::Solved&)> then;
    metrology::Dataset dataset;  // until it is being solved
  };
  void begin(Case next);
  void attend();
  void conclude(const Case& run, std::uint32_t number, bool lasts, const metrology::Solved& solved);
  Outcome<std::vector<store::Id>, store::Failure> stored(const Case& solved_case, const metrology::Solved& solved);
  Outcome<store::Id, store::Failure> storedAbout(const std::string& subject, const Case& solved_case,
                                                 const metrology::Result& result);
  std::vector<store::Id> namedResults(const metrology::Dataset& dataset);
  std::optional<store::Id> keep(const Case& run, const metrology::Solved& solved);
  void setRefusal(const std::string& text);
  void insist(const Event& command);

  store::Store store_;
  procedure::Facts facts_;
  std::function<MonoTime()> now_;
  TellCore tell_core_;
  ResultsInForce in_force_;
  SolverProcess solver_;
  std::optional<Case> being_solved_;
  std::deque<Case> waiting_;
  std::uint32_t dataset_run_{};
  std::shared_ptr<const std::string> dataset_;
  mutable std::mutex mutex_;
  std::string last_refusal_;
};

}  // namespace probebox::app
