#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/box/block_builder.hpp"
#include "firmware/box/control_axes.hpp"
#include "firmware/box/outputs.hpp"
#include "firmware/box/parked_changes.hpp"
#include "firmware/box/rate_meter.hpp"
#include "firmware/box/receiver_axes.hpp"
#include "firmware/box/sequence_watch.hpp"
#include "firmware/box/state.hpp"
#include "firmware/capture/common_stamps.hpp"
#include "firmware/capture/touch_dataset.hpp"
#include "firmware/clock/counter_clock.hpp"
#include "firmware/clock/estimator.hpp"
#include "firmware/clock/mapped_counter.hpp"
#include "firmware/corrections/corrections.hpp"
#include "firmware/latch/latch.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/procedure.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::box {

struct BoxConfig {
  clock::ClockConfig clock;
  clock::CounterClockConfig probe_clock;  // for a receiver that counts its own samples
  bool has_second_receiver{};             // on the sync line of that one, with its rate
  clock::CounterClockConfig control_clock{.max_sigma =
                                              std::chrono::microseconds{200}};  // of positions from the controller
  latch::LatchConfig latch;
  std::array<double, kLinearAxes> mm_per_count{};  // signed by the sense of the axis
  bool has_y{true};                                // false: a lathe of X and Z, whose Y stands at 0
  corrections::CorrectionsConfig corrections;
  capture::Capacity capture;
  bool counts_have_own_stamps{};                             // axes are read one by one, and not latched together
  procedure::LiveMethods methods{procedure::liveMethods()};  // that can be run
  std::optional<std::uint8_t> tool_setter_line;              // number of a line with the role trigger
  std::optional<std::uint8_t> probe_switch_line;             // the same for a touch-trigger probe; empty: it samples
  bool probe_reads_distances{};                              // and does not touch
  std::uint32_t block_samples = 128;
  Nanoseconds block_age = std::chrono::milliseconds{100};  // a block is closed at this age even when it is not full
};

// Names the first value that is out of range and its valid range; nullopt when the configuration is valid.
std::optional<Error> validate(const BoxConfig& config);

// Explains why a box with this configuration cannot apply the result that `result` activates; nullopt when it can.
std::optional<Error> validateActivation(const BoxConfig& config, std::span<const Event> result);

// Runs the whole core as a function of stamped events. It reads no clock, makes no system call and allocates nothing
// after construction, so equal events give equal bytes.
class Box {
 public:
  // config: must pass validate(). `outputs` must outlive the box.
  Box(const BoxConfig& config, Outputs& outputs);

  void push(const Event& event);
  // Publishes the state before the first TimeAdvanced, so that no reader gets zeros meanwhile. Call behind what was in
  // force before the start: a cut may be on from here on.
  void showBeforeStart(MonoTime now);

  const State& state() const { return state_; }
  const procedure::Plan& plan() const { return procedure_.plan(); }
  // Stable between Outputs::solve() and the Solved event that answers it.
  const capture::Recording& recording() const { return procedure_.recording(); }
  capture::Scales scales() const;
  // The delay that is applied to the samples of the present block; not calibrated when none is applied.
  published::DelayInForce delayInSamples() const;
  published::ToolInSamples toolInSamples() const { return corrections_.toolInSamples(state_.at); }
  // Number of the next trigger: all before it were reported or are lost.
  std::uint32_t nextTrigger() const { return corrections_.nextTriggerNumber(); }

 private:
  void on(const TimeAdvanced& time);
  void on(const Edge& edge);
  void on(const Count& count);
  void on(const AngleCount& count);
  void on(const Deflection& deflection);
  void on(const CountedDeflection& counted);
  void onSecond(const CountedDeflection& counted);
  void on(const CountedAxes& counted);
  void on(const CountedIndex& index);
  void on(const CountedEdge& counted);
  std::optional<MonoTime> timeAfter(std::uint8_t receiver, const clock::CounterReading& sample, std::uint32_t fraction);
  void on(const ControlPositions& positions);
  void on(const Drift& drift);
  void on(const Marker& marker);
  void on(const SourceLost& lost);
  void on(const ProcedureStarted& started);
  void on(const ProcedureAborted& aborted) { procedure_.abort(aborted); }
  void on(const Solved& solved) { procedure_.solved(solved); }
  void on(const DelayActivated& activated);
  // Activations, homing, poses, cuts, enabled sources.
  void on(const auto& for_corrections) { corrections_.push(for_corrections); }

  void handle(const Event& event);
  std::uint32_t countEdge(const Edge& edge);
  void touched(const Edge& edge, std::uint32_t missing);
  void take(const Deflection& deflection);
  void record(const Count& count, std::optional<std::int32_t> screw_nm);
  void take(const Count& count);
  void take(const AngleCount& count);
  void take(std::size_t axis, std::uint32_t sequence, std::int64_t counts, MonoTime at);
  void drainLatch();
  void tick(const latch::Record& record);
  void emitTriggers();
  void reportLoss(const latch::Lost& lost);
  void closeBlock();
  void publish(MonoTime now);

  BoxConfig config_;
  Outputs& outputs_;
  clock::ClockEstimator clock_;
  clock::CounterClock probe_clock_;
  clock::MappedCounter second_receiver_;
  bool sync_by_receiver_{};  // its clock is between a tick and this computer's
  clock::CounterClock control_clock_;
  latch::Latch latch_;
  capture::CommonStamps common_stamps_;
  procedure::Procedure procedure_;
  corrections::Corrections corrections_;
  ParkedChanges parked_;
  BlockBuilder block_;
  PerLine<SequenceWatch> line_sequence_;
  std::array<SequenceWatch, kLinearAxes> count_sequence_;
  std::array<SequenceWatch, kRotaryAxes> angle_sequence_;
  SequenceWatch probe_sequence_;
  std::array<ReceiverAxes, kReceivers> receiver_axes_;
  ControlAxes control_axes_;
  RateMeter rate_meter_;
  std::uint64_t lost_in_queue_samples_{};
  std::uint64_t source_losses_unreported_{};  // those among them that were lost at their source before
  std::uint64_t unencodable_samples_{};
  State state_;
};

}  // namespace probebox::box
