#pragma once
#include <cstdint>

#include "firmware/capture/touch_capture.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "protocol/events/event.hpp"

namespace probebox::procedure {

enum class State : std::uint8_t {
  idle = 0,
  waiting = 1,   // for the machine to begin a step
  running = 2,   // between the markers of begin and end
  solving = 3,   // the recording is with the worker
  proposed = 4,  // a result waits for somebody to accept it; with result_id 0 all is done, and nothing waits
  refused = 5,
  aborted = 6,
};

// Where a run stands. Plain, so that it can be published whole.
struct Progress {
  std::uint32_t run{};
  Method method{};
  State state{};
  std::uint32_t step{};
  std::uint32_t steps{};
  std::uint32_t repeats{};           // of the present step
  capture::TouchFault last_fault{};  // why the present step is repeated, or why the run was refused
  bool timed_out{};                  // the end of a step never came
  std::uint64_t result_id{};
  RimLoops rim{};  // of centreline-by-steps, as far as they are known
};

// The step machine of the measuring procedures: a marker begins a step, a marker ends it; a faulty step is asked for
// again. Of centreline-by-steps the later steps follow from what the earlier ones have measured: whoever solves says
// how the run goes on.
class Procedure {
 public:
  static constexpr std::uint32_t kMostRepeats = 3;
  // A begun step that has not ended by then, beside the time that its travel takes, is asked for again.
  static constexpr Nanoseconds kStepTimeout = std::chrono::seconds{60};

  // How far the machine may say that a rotary axis stands from where the step needs it.
  static constexpr double kPoseTolerance_rad = 2e-3;

  // mm_per_count: of the linear axes.
  explicit Procedure(capture::Capacity capacity, const std::array<double, kLinearAxes>& mm_per_count = {})
      : capture_{capacity, mm_per_count} {}

  // Ignored while a run is in progress, and for a method or options that cannot be planned. `delay` is the one in
  // force, result_id 0 for none; `offset_mm` the machine position where the counts are 0.
  void start(const ProcedureStarted& started, const DelayActivated& delay = {},
             const std::array<double, kLinearAxes>& offset_mm = {});
  void abort(const ProcedureAborted& aborted);
  // `map` is the clock's, of this moment. Markers of another run or step are counted and change nothing.
  void mark(const Marker& marker, const TickMap& map);
  void push(const Count& count, std::optional<std::int32_t> screw_nm = 0) { capture_.push(count, screw_nm); }
  void push(const Deflection& deflection) { capture_.push(deflection); }
  void push(const Drift& drift) { capture_.push(drift); }
  void push(const SourceLost& lost) { capture_.push(lost); }
  void push(const Edge& edge) { capture_.push(edge); }  // of the tool-setting device
  void advance(MonoTime now);
  void solved(const Solved& solved);

  // True once, when all steps are done and the recording is ready for the worker, which may read it until solved().
  bool takeReadyToSolve();

  const Progress& progress() const { return progress_; }
  const Plan& plan() const { return plan_; }
  const capture::Recording& recording() const { return capture_.recording(); }
  std::uint64_t incompleteRows() const { return capture_.incompleteRows(); }
  std::uint64_t strayMarkers() const { return stray_markers_; }

 private:
  void beginStep(const Marker& marker);
  void endStep(const TickMap& map);
  void repeatStep(capture::TouchFault fault);
  void goOn(const Solved& solved);

  Plan plan_;
  ProcedureOptions options_;
  capture::TouchCapture capture_;
  Progress progress_;
  MonoTime step_begun_{};
  bool ready_to_solve_{};
  std::uint64_t stray_markers_{};
};

}  // namespace probebox::procedure
