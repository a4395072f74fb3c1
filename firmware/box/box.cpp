#include "firmware/box/box.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <variant>

#include "firmware/box/calibration_progress.hpp"
#include "firmware/clock/tick_map.hpp"

namespace probebox::box {
namespace {

constexpr double kUnknown_ns = 4e9;  // instead of a standard deviation

std::array<Nanoseconds, kLinearAxes> tauOf(const DelayActivated& activated) {
  std::array<Nanoseconds, kLinearAxes> tau{};
  for (std::size_t axis = 0; axis < kLinearAxes && activated.result_id != 0; ++axis)
    tau[axis] = Nanoseconds{std::llround(activated.tau_s[axis] * 1e9)};
  return tau;
}

procedure::Zeros zerosOf(const corrections::Corrections& corrections) {
  procedure::Zeros zeros;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    zeros.offset_mm[axis] = corrections.reference(axis).zero_mm();
    zeros.breaks[axis] = corrections.reference(axis).breaks();
    const auto& screw = corrections.screw(axis);
    zeros.screw_results[axis] = screw.results();
    zeros.extension_mm[axis] = screw.fitted() ? screw.extension_um() * 1e-3 : 0;
  }
  zeros.breaks_of_c = corrections.reference(RotaryAxis::c).breaks();
  return zeros;
}

published::EdgeCounters edgesOf(const clock::ClockCounters& counters) {
  return {.accepted = counters.accepted + counters.clipped,
          .missing = counters.missing,
          .doubled = counters.doubled,
          .spurious = counters.spurious + counters.unfitting,
          .lost = counters.lost_by_kernel,
          .unlocked = counters.unlocked};
}

// A longer period is a slower clock.
double frequency_ppb(double offset_ppm) {
  return -offset_ppm * 1e3;
}

ProbeClock clockOf(const clock::CounterClock& clock) {
  return {.state = clock.state(),
          .offset_ppm = clock.offsetPpm(),
          .sigma_ns = clock.sigmaNs(),
          .counters = clock.counters()};
}

published::ReceiverStatus receiverOf(const ProbeClock& clock) {
  const auto& counters = clock.counters;
  const bool is_good = clock.state == ClockState::locked || clock.state == ClockState::holdover;
  return {.state = clock.state,
          .sigma_ns = is_good ? static_cast<std::uint32_t>(std::lround(clock.sigma_ns)) : 0,
          .frequency_ppb = is_good ? frequency_ppb(clock.offset_ppm) : 0,
          .samples = counters.samples,
          .missing = counters.missing,
          .unstamped = counters.unstamped,
          .restarts = counters.restarts,
          .relocks = counters.relocks,
          .refused_frequency = counters.refused_frequency,
          .bad_packets = 0};
}

published::SecondReceiverStatus secondReceiverOf(const clock::MappedCounter& second) {
  const auto& samples = second.byArrival().counters();
  const auto& edges = second.counters();
  const bool is_good = second.state() == ClockState::locked || second.state() == ClockState::holdover;
  return {.state = second.state(),
          .sigma_ns = is_good ? static_cast<std::uint32_t>(std::lround(second.sigmaNs())) : 0,
          .frequency_ppb = is_good ? frequency_ppb(second.offsetPpm()) : 0,
          .samples = samples.samples,
          .missing = samples.missing,
          .unstamped = second.unstamped(),
          .restarts = edges.begun > 0 ? edges.begun - 1 : 0,
          .matched = edges.matched,
          .unmatched = edges.unmatched,
          .unseen = edges.unseen,
          .misfits = edges.misfits,
          .bad_packets = 0};
}

procedure::ProbeKind probeKindOf(const BoxConfig& config) {
  if (config.probe_switch_line) return procedure::ProbeKind::trigger;
  return config.probe_reads_distances ? procedure::ProbeKind::distance : procedure::ProbeKind::scanning;
}

}  // namespace

std::optional<Error> validateActivation(const BoxConfig& config, std::span<const Event> result) {
  const auto* delay = result.empty() ? nullptr : std::get_if<DelayActivated>(&result.front());
  if (delay == nullptr) return corrections::validateActivation(config.corrections, result);
  latch::LatchConfig with_delay = config.latch;
  with_delay.tau = tauOf(*delay);
  const auto refused = latch::validate(with_delay);
  if (!refused) return std::nullopt;
  return Error{"The box cannot move its samples by this delay: " + refused->what};
}

std::optional<Error> validate(const BoxConfig& config) {
  if (auto error = clock::validate(config.clock)) return error;
  if (auto error = clock::validate(config.probe_clock)) return error;
  if (auto error = clock::validate(config.control_clock)) return error;
  if (auto error = latch::validate(config.latch)) return error;
  if (auto error = corrections::validate(config.corrections)) return error;
  if (config.block_samples == 0 || config.block_samples > BlockBuilder::kMostSamples) {
    return Error{"A block has 1 to " + std::to_string(BlockBuilder::kMostSamples) + " samples, not " +
                 std::to_string(config.block_samples) + ": change block_samples in service.toml."};
  }
  return std::nullopt;
}

Box::Box(const BoxConfig& config, Outputs& outputs)
    : config_{config},
      outputs_{outputs},
      clock_{config.clock},
      probe_clock_{config.probe_clock},
      second_receiver_{{.counter = config.probe_clock, .sync_period = config.clock.nominal_period}},
      control_clock_{config.control_clock},
      latch_{config.latch},
      common_stamps_{{config.latch.axes[0].interval, config.latch.axes[1].interval, config.latch.axes[2].interval}},
      procedure_{config.methods, config.capture, config.mm_per_count, probeKindOf(config)},
      corrections_{config.corrections},
      block_{config.block_samples, static_cast<std::uint16_t>(config.latch.samples_per_tick)} {
  // Lines count their edges from 1: what is missing before the first one that comes is lost too.
  for (auto& lines : line_sequence_) lines.fill(SequenceWatch{0});
}

capture::Scales Box::scales() const {
  return {config_.mm_per_count, config_.clock.nominal_period};
}

published::DelayInForce Box::delayInSamples() const {
  return state_.delay_applied ? corrections_.state().delay : published::DelayInForce{};
}

void Box::push(const Event& event) {
  ++state_.events;
  if (corrections_.state().inhibited && changesCorrections(event)) {
    if (!parked_.push(event)) ++state_.lost.queue_events;
    return;
  }
  handle(event);
  if (!corrections_.state().inhibited && !parked_.empty()) parked_.release([this](const Event& e) { handle(e); });
  emitTriggers();
  if (procedure_.takeReadyToSolve()) outputs_.solve(procedure_.progress().run);
}

void Box::handle(const Event& event) {
  std::visit([this](const auto& e) { on(e); }, event);
  drainLatch();
}

void Box::on(const TimeAdvanced& time) {
  clock_.advance(time.at);
  probe_clock_.advance(time.at);
  if (config_.has_second_receiver) second_receiver_.advance(time.at);
  control_clock_.advance(time.at);
  latch_.setClock(clock_.map());
  latch_.advance(time.at);
  procedure_.advance(time.at);
  rate_meter_.advance(time.at);
  drainLatch();
  if (block_.olderThan(config_.block_age, time.at)) closeBlock();
  publish(time.at);
}

// Returns how many edges of that line were lost before this one.
std::uint32_t Box::countEdge(const Edge& edge) {
  const auto role = static_cast<std::size_t>(edge.role);
  const auto line = edge.line % kLinesOfRole;
  auto& watch = line_sequence_[role][line];
  auto& counters = state_.lines[role][line];
  const bool is_level_told_again = watch.standsAt(edge.line_sequence);
  if (!is_level_told_again) ++counters.edges;
  const std::uint32_t missing = watch.missingBefore(edge.line_sequence);
  counters.lost += missing;
  return missing;
}

void Box::on(const Edge& edge) {
  const std::uint32_t missing = countEdge(edge);
  if (edge.role != LineRole::sync) {
    state_.lost.line_edges += missing;
    latch_.push(edge);
    corrections_.push(edge);
    if (edge.role == LineRole::trigger) touched(edge, missing);
    return;
  }
  state_.lost.sync_edges += missing;
  clock_.push(edge);
  latch_.setClock(clock_.map());
}

// missing: edges of that line that were lost before this one. One of them may have been the contact or the release.
void Box::touched(const Edge& edge, std::uint32_t missing) {
  const bool of_setter = edge.line == config_.tool_setter_line;
  const bool of_probe = edge.line == config_.probe_switch_line;
  if ((of_setter || of_probe) && missing != 0)
    procedure_.push(SourceLost{Source::trigger, LossReason::overrun, missing, edge.at});
  if (of_setter) procedure_.push(edge, capture::SwitchOf::tool_setter);
  if (of_probe) procedure_.push(edge, capture::SwitchOf::probe);
}

void Box::on(const Count& count) {
  auto& watch = count_sequence_[static_cast<std::size_t>(count.axis)];
  state_.lost.counts += watch.missingBefore(count.sequence);
  take(count);
}

// An axis that the machine does not have stands at 0 whenever the first one is latched, so that all that needs three
// axes has them.
void Box::take(const Count& count) {
  if (!config_.has_y && count.axis == Axis::x) take(Count{Axis::y, count.sequence, 0, count.at});
  rate_meter_.sample(count);
  latch_.push(count);
  corrections_.push(count);
  // The encoders sit on the motors, so a warm screw puts the tool elsewhere than they say: what is measured is where
  // the tool was. A correction that the machine was moved by is in its counts already, and is not taken out again.
  record(count, corrections_.screw_nm(count.axis, count.at));
}

// A row of a touch has all axes at one stamp.
void Box::record(const Count& count, std::optional<std::int32_t> screw_nm) {
  if (!config_.counts_have_own_stamps) return procedure_.push(count, screw_nm);
  common_stamps_.push(count, screw_nm);
  while (const auto row = common_stamps_.next())
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
      procedure_.push(Count{static_cast<Axis>(axis), 0, row->counts[axis], row->at}, row->screw_nm[axis]);
}

void Box::on(const AngleCount& count) {
  state_.lost.counts += angle_sequence_[static_cast<std::size_t>(count.axis)].missingBefore(count.sequence);
  take(count);
}

void Box::take(const AngleCount& count) {
  corrections_.push(count);
  const auto latched_rad = corrections_.latched_rad(count.axis);
  if (count.axis == RotaryAxis::c && latched_rad) procedure_.push(capture::AngleRow{count.at, *latched_rad});
}

void Box::on(const Deflection& deflection) {
  state_.lost.deflections += probe_sequence_.missingBefore(deflection.sequence);
  take(deflection);
}

void Box::on(const CountedDeflection& counted) {
  if (counted.receiver != 0) return onSecond(counted);
  const std::uint64_t missing = probe_clock_.counters().missing;
  const auto stamped = probe_clock_.push(counted);
  const std::uint64_t lost = probe_clock_.counters().missing - missing;
  state_.lost.deflections += lost;
  state_.lost.counts += lost * receiver_axes_[0].axes();
  receiver_axes_[0].placed(counted.counter, stamped ? std::optional{stamped->at} : std::nullopt);
  if (stamped) {
    take({.sequence = counted.counter,
          .channels_nm = counted.channels_nm,
          .clipped = counted.clipped,
          .at = stamped->at});
  } else {
    // A touch with samples of unknown time has a hole.
    procedure_.push(SourceLost{Source::probe, LossReason::overrun, 1, counted.at});
  }
}

// Of a second receiver only the number of the sample counts: nobody reads its deflections.
void Box::onSecond(const CountedDeflection& counted) {
  if (!config_.has_second_receiver) return;
  const std::uint64_t missing = second_receiver_.byArrival().counters().missing;
  const auto stamped = second_receiver_.push(probe_clock_, {counted.run, counted.counter, counted.newest, counted.at});
  const std::uint64_t lost = second_receiver_.byArrival().counters().missing - missing;
  auto& axes = receiver_axes_[1];
  state_.lost.counts += lost * axes.axes();
  axes.placed(counted.counter, stamped ? std::optional{stamped->at} : std::nullopt);
}

void Box::on(const CountedAxes& counted) {
  auto& axes = receiver_axes_[counted.receiver % kReceivers];
  if (const auto broken = axes.broken(counted))
    on(SourceLost{Source::encoders, LossReason::overrun, 0, counted.at, broken});
  const auto at = axes.timeOf(counted);
  if (!at) return;  // told with the deflection of the same sample
  // What a counter that lost counts, or an absolute encoder that could not be read, says is no position.
  const unsigned bad = unsigned{counted.axes} & counted.faults, good = counted.axes & ~bad;
  state_.lost.counts += static_cast<std::uint64_t>(std::popcount(bad));
  for (std::size_t axis = 0; axis < counted.counts.size(); ++axis)
    if ((good >> axis & 1U) != 0) take(axis, counted.counter, counted.counts[axis], *at);
}

void Box::on(const CountedIndex& index) {
  if (index.axis >= kLinearAxes + kRotaryAxes) return;
  const auto at = timeAfter(index.receiver, {index.run, index.counter, false, index.at}, index.fraction);
  if (!at) return;  // without a time there is no reference; the next pulse gives it
  const Edge edge{.role = LineRole::index,
                  .line = index.axis,
                  .level = Level::active,
                  .line_sequence = receiver_axes_[index.receiver % kReceivers].nextIndex(index.axis),
                  .at = *at};
  countEdge(edge);
  latch_.push(edge);
  // No sample of the axis, to be interpolated with or to tell its speed: its time can be a sample period off.
  if (index.axis < kLinearAxes) corrections_.push(edge, index.counts);
}

std::optional<MonoTime> Box::timeAfter(std::uint8_t receiver, const clock::CounterReading& sample,
                                       std::uint32_t fraction) {
  return receiver == 0 ? probe_clock_.timeAfter(sample, fraction)
                       : second_receiver_.timeAfter(probe_clock_, sample, fraction);
}

// An edge of unknown time is lost, but not what an inhibit says: no time makes that wrong. The sync line of a second
// receiver is that of the first, and maps the one onto the other.
void Box::on(const CountedEdge& counted) {
  const clock::CounterReading sample{counted.run, counted.counter, false, counted.at};
  const bool maps = config_.has_second_receiver && counted.role == LineRole::sync && counted.level == Level::active;
  if (maps && counted.receiver == 0) second_receiver_.sawFirst(probe_clock_, sample, counted.fraction);
  if (maps && counted.receiver != 0) second_receiver_.sawSecond(probe_clock_, sample, counted.fraction);
  if (counted.role == LineRole::sync && counted.receiver != 0) {
    state_.lost.line_edges += countEdge({counted.role, counted.line, counted.level, counted.line_sequence, counted.at});
    return;
  }
  const auto at = timeAfter(counted.receiver, sample, counted.fraction);
  if (!at && counted.role != LineRole::inhibit) return;
  if (counted.role == LineRole::sync) sync_by_receiver_ = true;
  on(Edge{.role = counted.role,
          .line = counted.line,
          .level = counted.level,
          .line_sequence = counted.line_sequence,
          .at = at.value_or(counted.at)});
}

void Box::on(const ControlPositions& positions) {
  if (const auto broken = control_axes_.broken(positions); broken != 0)
    on(SourceLost{Source::encoders, LossReason::overrun, 0, positions.at, broken});
  const auto stamped = control_clock_.push({positions.run, positions.counter, positions.newest, positions.at});
  if (!stamped) return;  // of unknown time: until the clock is locked there are no positions
  for (std::size_t axis = 0; axis < positions.counts.size(); ++axis)
    if ((positions.axes >> axis & 1U) != 0) take(axis, positions.counter, positions.counts[axis], stamped->at);
}

void Box::take(std::size_t axis, std::uint32_t sequence, std::int64_t counts, MonoTime at) {
  if (axis < kLinearAxes)
    take(Count{static_cast<Axis>(axis), sequence, counts, at});
  else
    take(AngleCount{static_cast<RotaryAxis>(axis - kLinearAxes), sequence, counts, at});
}

void Box::on(const Drift& drift) {
  corrections_.push(drift);
  procedure_.push(drift);
}

void Box::take(const Deflection& deflection) {
  rate_meter_.sample(deflection);
  latch_.push(deflection);
  procedure_.push(deflection);
}

void Box::on(const ProcedureStarted& started) {
  const auto& delay = corrections_.state().delay;
  procedure_.start(started, {.result_id = delay.result_id, .tau_s = delay.tau_s, .sd_s = delay.sd_s, .at = started.at},
                   zerosOf(corrections_));
}

void Box::on(const Marker& marker) {
  latch_.push(marker);
  procedure_.mark(marker, clock_.map(), zerosOf(corrections_));
}

void Box::on(const SourceLost& lost) {
  if (lost.source == Source::queue) state_.lost.queue_events += lost.lost;
  const bool is_gone = lost.reason == LossReason::disconnected || lost.reason == LossReason::taken;
  if (is_gone) ++state_.lost.sources_gone;
  if (is_gone && lost.source == Source::probe) probe_clock_.restart();
  if (is_gone && lost.source == Source::encoders) {
    if (receiver_axes_[1].isAmong(lost.axes)) second_receiver_.restart();
    for (auto& axes : receiver_axes_)
      if (axes.isAmong(lost.axes)) axes.forget();
  }
  corrections_.push(lost);
  procedure_.push(lost);
}

void Box::drainLatch() {
  while (const auto decision = latch_.next()) {
    if (const auto* record = std::get_if<latch::Record>(&*decision)) {
      block_.add(*record, latch_.clock(), state_.at);
      tick(*record);
      if (block_.full()) closeBlock();
    } else {
      const auto& lost = std::get<latch::Lost>(*decision);
      closeBlock();
      reportLoss(lost);
    }
  }
}

// The samples that were decided so far keep the delay that they were made with.
// An axis that stands is as late as the first one.
void Box::on(const DelayActivated& measured) {
  DelayActivated activated = measured;
  if (!config_.has_y) {
    activated.tau_s[1] = measured.tau_s[0];
    activated.sd_s[1] = measured.sd_s[0];
  }
  drainLatch();
  closeBlock();
  state_.delay_applied = latch_.setTau(tauOf(activated));
  if (!state_.delay_applied) latch_.setTau({});  // none rather than one that is not in force any more
  corrections_.push(activated);
}

// Corrections follow the first sample of every tick.
void Box::tick(const latch::Record& record) {
  const auto samples_per_tick = config_.latch.samples_per_tick;
  if (record.index.index % samples_per_tick != 0) return;
  corrections_.tick(record, clock::timeOf(latch_.clock(), record.index, samples_per_tick));
}

void Box::emitTriggers() {
  while (const auto stamp = corrections_.nextTrigger()) {
    const TickMap& map = latch_.clock();
    PlacedTrigger placed{.stamp = *stamp, .sigma_ns = map.sigma_ns, .clock_state = map.state};
    if (map.state != ClockState::unlocked) {
      placed.tick = clock::tickBefore(map, stamp->at);
      placed.phase_q32 = clock::phaseQ32(map, stamp->at);
    }
    outputs_.trigger(placed);
  }
}

void Box::reportLoss(const latch::Lost& lost) {
  if (outputs_.lost(lost)) return;
  // The links tell these as lost in the queue: one reason each.
  lost_in_queue_samples_ += static_cast<std::uint64_t>(lost.count);
  source_losses_unreported_ += static_cast<std::uint64_t>(lost.count);
}

void Box::closeBlock() {
  if (block_.empty()) return;
  const auto first = block_.first();
  const auto count = block_.count();
  const auto bytes = block_.close();
  if (bytes.empty()) {
    unencodable_samples_ += count;
    reportLoss({.first = first, .count = count, .reason = latch::LostReason::encoders});
  } else if (!outputs_.block(first, count, bytes)) {
    lost_in_queue_samples_ += count;
  }
}

void Box::showBeforeStart(MonoTime now) {
  corrections_.awaitInhibitLines();
  state_.at = now;
  state_.snapshot = {
      corrections_.state(), calibrationOf(procedure_.progress(), procedure_.plan(), corrections_.state().delay), {}};
  outputs_.state(state_);
}

void Box::publish(MonoTime now) {
  const auto& latch = latch_.counters();
  const published::Ledger ledger{
      .produced = static_cast<std::uint64_t>(latch.produced),
      .lost_at_source = static_cast<std::uint64_t>(latch.lost) + unencodable_samples_ - source_losses_unreported_,
      .lost_in_queue = lost_in_queue_samples_};
  const TickMap& map = clock_.map();
  corrections_.advance(now, map, ledger);
  const auto& progress = procedure_.progress();
  state_.at = now;
  state_.map = map;
  state_.probe_clock = clockOf(probe_clock_);
  state_.control_clock = clockOf(control_clock_);
  const auto& lost = state_.lost;
  const auto receiver = receiverOf(state_.probe_clock);
  const bool is_known =
      !sync_by_receiver_ || receiver.state == ClockState::locked || receiver.state == ClockState::holdover;
  const double absolute_ns =
      is_known ? std::hypot(map.sigma_ns, sync_by_receiver_ ? receiver.sigma_ns : 0) : kUnknown_ns;
  const published::CoreStatus core{
      .clock = {.state = map.state,
                .sigma_ns = map.sigma_ns,
                .frequency_ppb = frequency_ppb(clock_.offsetPpm()),
                .tick = map.tick,
                .edges = edgesOf(clock_.counters()),
                .absolute_sigma_ns = static_cast<std::uint32_t>(std::lround(std::min(absolute_ns, kUnknown_ns)))},
      .receiver = receiver,
      .ledger = ledger,
      .events = {.received = state_.events,
                 .lost = lost.sync_edges + lost.line_edges + lost.counts + lost.deflections,
                 .lost_in_queue = lost.queue_events,
                 .late = latch.late,
                 .disordered = latch.disordered,
                 .overwritten = latch.overwritten,
                 .incomplete_rows = procedure_.incompleteRows() + common_stamps_.incomplete(),
                 .stray_markers = procedure_.strayMarkers(),
                 .lost_in_journal = 0,
                 .sources_gone = lost.sources_gone},
      .second_receiver = secondReceiverOf(second_receiver_)};
  state_.snapshot = {corrections_.state(), calibrationOf(progress, procedure_.plan(), corrections_.state().delay),
                     core};
  state_.procedure = progress;
  state_.rates = rate_meter_.rates();
  outputs_.state(state_);
}

}  // namespace probebox::box
