#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "firmware/capture/touch_capture.hpp"
#include "firmware/procedure/plan/live_method.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::procedure {

using State = RunState;

// State of a run. Plain data, published as a whole.
struct Progress {
  std::uint32_t run{};
  const LiveMethod* method{};  // nullptr: there was no run
  State state{};
  std::uint32_t step{};
  std::uint32_t steps{};
  std::uint32_t repeats{};           // of the present step
  capture::TouchFault last_fault{};  // why the present step is repeated, or the run was refused
  bool timed_out{};                  // the end of a step never came
  std::uint64_t result_id{};
  LoopState loops{};  // known so far
  bool passing{};     // a dry run is at this step: nothing was recorded yet
};

// What the axes count from, and what positions of the linear ones are corrected by.
struct Zeros {
  std::array<std::optional<double>, kLinearAxes> offset_mm{};  // machine positions at count 0; none without a reference
  std::array<std::uint32_t, kLinearAxes> breaks{};             // how often counts did not go on from those before
  std::uint32_t breaks_of_c{};
  std::array<std::uint32_t, kLinearAxes> screw_results{};  // how often another result about the screw came into force
  std::array<double, kLinearAxes> extension_mm{};          // of the screw, whose part is taken out of known positions
};

// Why a marker of the present step is not taken in this state of a dry run.
std::optional<Error> whyNotNow(const Progress& progress, MarkerPhase phase);

// Runs measuring procedures step by step: a marker begins a step, a marker ends it, and a faulty step is repeated,
// unless it pressed the probe to the end of its range: that ends the run.
// Later steps of methods with loops depend on earlier measurements; the worker supplies them with Solved.
class Procedure {
 public:
  static constexpr std::uint32_t kMostRepeats = 3;
  // A step that has not ended after this time plus its travel time is repeated.
  static constexpr Nanoseconds kStepTimeout = std::chrono::seconds{60};

  // methods: those that can be started. mm_per_count: of the linear axes. probe: how it reports a contact.
  explicit Procedure(LiveMethods methods, capture::Capacity capacity,
                     const std::array<double, kLinearAxes>& mm_per_count = {}, ProbeKind probe = ProbeKind::scanning)
      : methods_{methods}, probe_{probe}, capture_{capacity, mm_per_count} {}

  // Starts a run. Does nothing during a run, for an unknown method number, and for options that cannot be planned.
  // delay: the one in force, result_id 0 for none.
  void start(const ProcedureStarted& started, const DelayActivated& delay = {}, const Zeros& zeros = {});
  void abort(const ProcedureAborted& aborted);
  // `map`: present clock map. Markers of another run or step are only counted. When positions about these zeros do not
  // go with those about the zeros of the start, the run is refused, but begins anew with them while no step is kept and
  // all that it needs are known.
  void mark(const Marker& marker, const TickMap& map, const Zeros& zeros = {});
  void push(const Count& count, std::optional<std::int32_t> screw_nm = 0) { capture_.push(count, screw_nm); }
  void push(const Deflection& deflection) { capture_.push(deflection); }
  void push(const Drift& drift) { capture_.push(drift); }
  void push(const SourceLost& lost) { capture_.push(lost); }
  void push(const capture::AngleRow& angle) { capture_.push(angle); }
  void push(const Edge& edge, capture::SwitchOf of = capture::SwitchOf::tool_setter) { capture_.push(edge, of); }
  void advance(MonoTime now);
  void solved(const Solved& solved);

  // Returns true once, when all steps are done. The worker may then read the recording until solved().
  bool takeReadyToSolve();

  const Progress& progress() const { return progress_; }
  const Plan& plan() const { return plan_; }
  const capture::Recording& recording() const { return capture_.recording(); }
  std::uint64_t incompleteRows() const { return capture_.incompleteRows(); }
  std::uint64_t strayMarkers() const { return stray_markers_; }

 private:
  bool beginAnew(const Zeros& zeros, capture::TouchFault apart);
  void beginStep(const Marker& marker);
  void endStep(const TickMap& map);
  void passStep();
  void repeatStep(capture::TouchFault fault);
  void goOn(const Solved& solved);

  LiveMethods methods_;
  ProbeKind probe_;
  Plan plan_;
  ProcedureOptions options_;
  capture::TouchCapture capture_;
  Zeros zeros_;
  Progress progress_;
  MonoTime step_begun_{};
  bool ready_to_solve_{};
  std::uint64_t stray_markers_{};
};

}  // namespace probebox::procedure
