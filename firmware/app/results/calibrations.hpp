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

#include "firmware/app/results/cutting_time.hpp"
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

// Solves recorded runs and proposed cases, and stores, serves and activates their results. For the worker's thread,
// except lastRefusal(), factsNow(), valuesInUse() and those of ResultsInForce: any thread may call these.
class Calibrations {
 public:
  // tell_core: passes a command to the core; false when its queue is full. solver: the program that solves cases
  // (SolverProcess). cutting: outlives this; each case says how long the machine had cut.
  using TellCore = std::function<bool(const Event&)>;
  Calibrations(store::Store store, Mounting mounting, procedure::Facts facts, std::function<MonoTime()> now,
               ResultsInForce::ValidateActivation validate_activation, TellCore tell_core,
               std::filesystem::path solver = {}, const CuttingTime* cutting = nullptr);

  // Events that the core must get before any others: the results in force.
  std::vector<Event> restore() { return in_force_.restore(); }
  // Handles the newest state of the core and the solver's answers. Call repeatedly.
  void look(const box::State& state);
  // Readable when the solver has something for look(); -1 while nothing is being solved.
  int solverDescriptor() const { return solver_.descriptor(); }
  // At the end of the daemon: waits for runs that are being solved or wait for it, and stores the data of unsolved ones
  // as refusals.
  void finishSolving(std::chrono::milliseconds at_most);

  // Solves a run of this plan. A calibration's result is stored as proposed; a selftest's findings are answered only.
  void solve(std::uint32_t run, const procedure::Plan& plan, const capture::Recording& recording,
             const capture::Scales& scales);
  // Solves a case that was measured without the box, stores the outcome, and calls `then`, at once or in a later
  // look(). A case that names its probe, machine or mounting must name those of this box. One at a time.
  struct Proposed {
    store::Id id{};
    std::string refusal;          // "name: reason"; empty if there is a result
    std::vector<store::Id> also;  // results about further subjects
  };
  using Answered = std::function<void(Outcome<Proposed>)>;
  // as_this_machine_by: the person who vouches that a case without names of probe, machine and mounting was measured
  // with those of this box; empty: no one does, and such a case is refused.
  void propose(metrology::Dataset dataset, const std::string& as_this_machine_by, Answered then);
  // Beyond the record: results that it rests on, and who vouched that it was measured on this machine.
  Outcome<std::vector<store::Dependence>, store::Failure> restsOn(store::Id id) { return store_.restsOn(id); }
  bool isToRepeat(const store::Dependence& other) const { return in_force_.isToRepeat(other.id); }
  std::string adoptedBy(store::Id id);
  bool isProposing() const;
  // Cancels the proposed case: nothing is stored and `then` is not called.
  void cancelProposal();
  // The described facts, with those from calibrations in force. Any thread.
  procedure::Facts factsNow() const;
  // A sentence for each place whose typed and measured values, or two measured ones, are too far apart. Any thread.
  std::vector<std::string> placesThatDisagree() const;
  // Values in use with their sources. Any thread.
  std::vector<messages::ValueInUse> valuesInUse() const { return app::valuesInUse(facts_, in_force_.about()); }
  ResultsInForce& inForce() { return in_force_; }
  const ResultsInForce& inForce() const { return in_force_; }
  // Results by rising id, at most `count` above `after`; newest: only among the newest so many, 0 for all.
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
  // A result that a case names in its key "..._result".
  struct NamedResult {
    std::string key;
    store::Id id{};
  };
  // A case that waits for the solver or is being solved, in order of arrival. Only a proposal can be cancelled.
  struct Case {
    std::vector<metrology::NamedSubject> subjects;
    store::Origin origin;  // rests_on is that of each subject
    std::vector<NamedResult> named;
    std::string method;
    std::shared_ptr<const std::string> text;  // JSON, as solved and stored
    bool proposed{};
    std::function<void(const metrology::Solved&)> then;
    metrology::Dataset dataset;  // until it is being solved
  };
  // What computations use, and the table that says where each length and place of it is from. kept: a row of it whose
  // typed value stays.
  struct InUse {
    procedure::Facts facts;
    std::vector<procedure::PlaceRow> places;
  };
  InUse inUse(std::string_view kept) const;
  std::vector<std::string> disagreementsIn(
      const metrology::Dataset& dataset,
      const std::function<procedure::RunDataset(const procedure::Facts&)>& built) const;
  void begin(Case next);
  void startNextCase();
  void pollSolver();
  void conclude(const Case& run, std::uint32_t number, bool lasts, const metrology::Solved& solved);
  Outcome<std::vector<store::Id>, store::Failure> stored(const Case& solved_case, const metrology::Solved& solved);
  store::Proposal proposalAbout(const metrology::NamedSubject& about, const Case& solved_case,
                                const metrology::Result& result) const;
  std::optional<Error> whyNotOfThisStore(const metrology::Dataset& dataset);
  std::vector<NamedResult> namedResults(const metrology::Dataset& dataset);
  std::optional<store::Id> keep(const Case& run, const metrology::Solved& solved);
  void setRefusal(const std::string& text);
  void postBlocking(const Event& command);

  store::Store store_;
  procedure::Facts facts_;
  std::function<MonoTime()> now_;
  TellCore tell_core_;
  const CuttingTime* cutting_;
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
