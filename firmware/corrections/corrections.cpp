#include "firmware/corrections/corrections.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <variant>

#include "firmware/corrections/measured_gain.hpp"

namespace probebox::corrections {
namespace {

// Encoder noise over one tick is no speed: about ten ticks are averaged.
constexpr double kSpeedSmoothing = 0.1;
// Counts that stand in for samples come at this distance already.
constexpr double kNoSmoothing = 1;

std::int32_t nanometres(double mm) {
  return static_cast<std::int32_t>(std::lround(mm * 1e6));
}
Nanometres nanometres(const Vector& mm) {
  return {nanometres(mm[0]), nanometres(mm[1]), nanometres(mm[2])};
}

}  // namespace

std::optional<Error> validate(const CorrectionsConfig& config) {
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const std::string name{"XYZ"[axis]};
    const auto& screw = config.screws[axis];
    if (screw.fitted && !(screw.model.length_mm > 0 && screw.model.pitch_mm > 0))
      return Error{"The screw of " + name + " needs a length and a pitch above 0: change [screw." + name +
                   "] in machine.toml."};
    if (!(config.limits[axis].size_mm >= 0 && config.limits[axis].rate_mm_s >= 0))
      return Error{"The correction limits of " + name + " cannot be negative: change [axis." + name +
                   "] in machine.toml."};
  }
  const bool any_screw = std::ranges::any_of(config.screws, &ScrewConfig::fitted);
  const std::array fitted{any_screw, config.swivel.fitted, config.rotary.fitted(), true};
  static_assert(fitted.size() == kSourceKinds);
  for (std::size_t kind = 0; kind < fitted.size(); ++kind) {
    if (hasSource(config.mask, kind) && !fitted[kind])
      return Error{"sources names \"" + std::string{kSources[kind].name} + "\", but machine.toml describes " +
                   std::string{kSources[kind].lacking} + ", or remove it from sources."};
  }
  return std::nullopt;
}

std::optional<Error> validateActivation(const CorrectionsConfig& config, std::span<const Event> result) {
  if (result.empty()) return std::nullopt;
  const auto rows = result.subspan(1);
  if (const auto* swivel = std::get_if<SwivelActivated>(&result.front()))
    return SwivelSource::validateActivation(config.swivel, *swivel, rows);
  if (const auto* rotary = std::get_if<RotaryActivated>(&result.front()))
    return RotarySource::validateActivation(config.rotary, *rotary, rows);
  return std::nullopt;
}

Corrections::Corrections(const CorrectionsConfig& config)
    : config_{config},
      references_{AxisReference{config.references[0]}, AxisReference{config.references[1]},
                  AxisReference{config.references[2]}},
      screws_{ScrewSource{config.screws[0], 0}, ScrewSource{config.screws[1], 1}, ScrewSource{config.screws[2], 2}},
      angles_{RotaryAngle{config.angles[0]}, RotaryAngle{config.angles[1]}, RotaryAngle{config.angles[2]}},
      tool_{config.tools},
      output_{config.limits},
      mask_{config.mask},
      inhibit_lines_{config.inhibit_lines} {}

void Corrections::push(const Count& count) {
  auto& reference = references_[static_cast<std::size_t>(count.axis)];
  reference.push(count.at, count.counts);
  if (const auto position_mm = reference.position_mm()) {
    triggers_.counted(count.axis, count.at, *position_mm);
  } else {
    triggers_.forget(count.axis);
  }
}

void Corrections::push(const AngleCount& count) {
  auto& angle = angles_[static_cast<std::size_t>(count.axis)];
  angle.push(count);
  if (const auto now_rad = angle.latched_rad()) triggers_.turned(count.axis, count.at, *now_rad);
}

std::optional<std::int32_t> Corrections::screw_nm(Axis axis, MonoTime now) const {
  const auto i = static_cast<std::size_t>(axis);
  if (!screws_[i].extensionKnown(now)) return std::nullopt;
  const auto position_mm = references_[i].position_mm();
  return position_mm ? nanometres(screws_[i].offset_mm() + screws_[i].slope() * *position_mm) : 0;
}

void Corrections::push(const Edge& edge, std::optional<std::int64_t> latched_counts) {
  if (edge.role == LineRole::index && edge.line < kLinearAxes && edge.level == Level::active) {
    references_[edge.line].index(edge.at, latched_counts);
  } else if (edge.role == LineRole::trigger && edge.level == Level::active) {
    triggers_.push(edge, history_.at(edge.at));
  } else if (edge.role == LineRole::inhibit) {
    inhibit_lines_.push(edge);
    inhibit();
  }
}

void Corrections::push(const SourceLost& lost) {
  const bool is_gone = lost.reason == LossReason::disconnected || lost.reason == LossReason::taken;
  // Counts that were missed leave all later ones wrong; readings of a sensor do not.
  const bool are_counts_wrong = lost.source == Source::encoders && lost.reason == LossReason::overrun;
  if (!is_gone && !are_counts_wrong) return;
  if (lost.source == Source::encoders) {
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
      if (lost.concerns(static_cast<Axis>(axis))) references_[axis].encoderLost(is_gone);
    for (std::size_t axis = 0; axis < kRotaryAxes; ++axis)
      if (lost.concerns(static_cast<RotaryAxis>(axis))) angles_[axis].encoderLost(is_gone);
    triggers_.encodersLost();
  } else if (lost.source == Source::drift) {
    for (auto& screw : screws_) screw.sensorLost();
  }
}

void Corrections::push(const AxisHomed& homed) {
  auto& reference = references_[static_cast<std::size_t>(homed.axis)];
  if (!reference.homed(homed.position_mm, homed.at)) {
    ++state_.refused_homings;
  } else {
    triggers_.forget(homed.axis);
  }
}

void Corrections::push(const PoseTold& pose) {
  for (std::size_t axis = 0; axis < kRotaryAxes; ++axis) {
    if ((unsigned{pose.axes} >> axis & 1U) == 0) continue;
    if (!angles_[axis].told(pose.angles_rad[axis], pose.at)) ++state_.refused_homings;
  }
  tool_.told(pose);
}

void Corrections::push(const DelayActivated& activated) {
  state_.delay = published::DelayInForce{activated.hasAllAxes(), activated.result_id, activated.tau_s, activated.sd_s,
                                         gainOf(activated)};
  const bool any = activated.result_id != 0;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    references_[axis].setDelay(activated.tau_s[axis], any ? activated.sd_s[axis] : 0);
    triggers_.setDelay(static_cast<Axis>(axis), any ? activated.tau_s[axis] : 0);
  }
}

void Corrections::push(const CutInhibit& inhibit_now) {
  inhibit_said_ = inhibit_now.active;
  inhibit();
}

void Corrections::awaitInhibitLines() {
  inhibit_lines_.await();
  inhibit();
}

void Corrections::inhibit() {
  state_.inhibited = inhibit_said_ || inhibit_lines_.cutIsOn();
  state_.cutting = inhibit_said_ || inhibit_lines_.isActive();
  state_.unknown_inhibit_lines = inhibit_lines_.unknown();
}

void Corrections::push(const AppliedRestored& applied) {
  output_.standAt(applied.correction_mm, applied.doubt_mm);
  const Nanometres value_nm = nanometres(output_.value_mm());
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) state_.correction_mm[axis] = value_nm[axis] * 1e-6;
  history_.push({.from = applied.at, .correction_nm = value_nm, .mask = mask_});
}

void Corrections::push(const SourcesEnabled& enabled) {
  mask_ = enabled.mask;
}

MachineTick Corrections::machineTick(MonoTime at) const {
  MachineTick tick{.at = at,
                   .elapsed_s = ticked_at_ ? toSeconds(at - *ticked_at_) : 0,
                   .position_mm = {},
                   .speed_mm_s = {},
                   .angles = {},
                   .tool_length_mm = tool_.length_mm()};
  for (std::size_t axis = 0; axis < kRotaryAxes; ++axis) tick.angles[axis] = angles_[axis].at(at);
  return tick;
}

void Corrections::tick(const latch::Record& record, MonoTime at) {
  MachineTick tick = machineTick(at);
  Vector u_mm{};
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const auto counts = static_cast<double>(record.values[static_cast<std::size_t>(latch::Channel::x) + axis]);
    u_mm[axis] = counts * config_.references[axis].mm_per_count;
    tick.position_mm[axis] = references_[axis].position_mm(counts);
  }
  sampled_since_advance_ = true;
  // The first samples after a silence are older than the counts that stood in for them.
  const bool is_overtaken = ticked_at_ && tick.at <= *ticked_at_;
  if (is_overtaken) return;
  triggers_.tick(tick);
  runSources(tick, u_mm, kSpeedSmoothing);
  tick_since_heartbeat_ = true;
}

// No source of corrections needs the probe or the master clock. Where samples fail to come for want of these, the
// latest counts take their place.
void Corrections::tickByCounts(MonoTime now) {
  MachineTick tick = machineTick(now);
  tick.by_counts = true;
  Vector u_mm{};
  bool any_counts = false;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const auto& reference = references_[axis];
    u_mm[axis] = reference.counted_mm();
    tick.position_mm[axis] = reference.position_mm();
    tick.position_doubtful[axis] = reference.isSilent(now, kSilence);
    any_counts = any_counts || !tick.position_doubtful[axis];
  }
  triggers_.tick(tick);
  runSources(tick, u_mm, kNoSmoothing);
  const Sum sum = this->sum();
  if (any_counts || (mask_ != 0 && !sum.any_invalid && !sum.any_held)) tick_since_heartbeat_ = true;
}

void Corrections::runSources(MachineTick& tick, const Vector& u_mm, double smoothing) {
  for (std::size_t axis = 0; axis < kLinearAxes && tick.elapsed_s > 0; ++axis)
    speed_mm_s_[axis] += smoothing * ((u_mm[axis] - u_mm_[axis]) / tick.elapsed_s - speed_mm_s_[axis]);
  u_mm_ = u_mm;
  tick.speed_mm_s = speed_mm_s_;
  ticked_at_ = tick.at;
  forEachSource(*this, [&](auto& source) { source.tick(tick); });
  const bool nothing_to_serve = mask_ == 0 && !was_valid_;
  if (const Sum now = sum(); now.any_invalid || nothing_to_serve) {
    output_.freeze(tick.elapsed_s);
  } else {
    output_.follow(now.value_mm, tick.elapsed_s);
  }
  tick_since_advance_ = true;
}

void Corrections::include(Sum& sum, SourceKind kind, const HeldSource& source) const {
  auto& health = sum.health[static_cast<std::size_t>(kind)];
  health = std::max(health, source.health());
  if (!sums(kind)) return;
  sum.any_invalid = sum.any_invalid || source.health() == Health::invalid;
  sum.any_held = sum.any_held || source.health() == Health::held;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) sum.value_mm[axis] += source.value()[axis];
}

Corrections::Sum Corrections::sum() const {
  Sum sum;
  std::uint16_t fitted = 0;
  forEachSource(*this, [&](const auto& source) {
    if (!source.fitted()) return;
    fitted |= bitOf(source.kKind);
    include(sum, source.kKind, source.held());
  });
  // A source that machine.toml does not describe says nothing, so the sum is not known.
  sum.any_invalid = sum.any_invalid || (mask_ & ~fitted) != 0;
  return sum;
}

void Corrections::serve(MonoTime now, const Sum& sum) {
  output_.published();
  state_.valid = output_.valid();
  was_valid_ = was_valid_ || state_.valid;
  state_.saturated = output_.saturated();
  state_.settled = state_.valid && output_.arrived();
  const bool frozen = was_valid_ && !state_.valid;
  state_.degraded = sum.any_held || (state_.valid && (state_.saturated || output_.keptBack())) || frozen;
  state_.mask = mask_;
  state_.health = sum.health;
  const Nanometres value_nm = nanometres(output_.value_mm());
  const Served& last = history_.newest();
  const bool changed = value_nm != last.correction_nm;
  if (changed) ++state_.sequence;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) state_.correction_mm[axis] = value_nm[axis] * 1e-6;
  const Served served{.from = now,
                      .correction_nm = value_nm,
                      .sequence = state_.sequence,
                      .mask = mask_,
                      .valid = state_.valid,
                      .degraded = state_.degraded};
  const bool told_otherwise =
      changed || served.valid != last.valid || served.degraded != last.degraded || served.mask != last.mask;
  if (told_otherwise) history_.push(served);
  if (tick_since_advance_ && !sum.any_invalid && !sum.any_held) fresh_at_ = now;
  state_.age_ms =
      static_cast<std::uint64_t>(std::chrono::duration_cast<std::chrono::milliseconds>(now - fresh_at_).count());
}

void Corrections::beat(MonoTime now) {
  // A beat whose period brought no record is skipped, not made up for later.
  while (now - heartbeat_at_ >= kHeartbeat) {
    heartbeat_at_ += kHeartbeat;
    if (tick_since_heartbeat_) ++state_.heartbeat;
    tick_since_heartbeat_ = false;
  }
}

void Corrections::advance(MonoTime now, const TickMap& map, const Ledger& ledger) {
  if (!std::exchange(started_, true)) {
    awaitInhibitLines();
    heartbeat_at_ = now;
    fresh_at_ = now;
    sampled_at_ = now;
  }
  if (sampled_since_advance_) sampled_at_ = now;
  if (now - sampled_at_ >= kSamplesMissing) tickByCounts(now);
  const Sum sum = this->sum();
  if (sum.any_invalid) output_.freeze(0);
  serve(now, sum);
  beat(now);
  tick_since_advance_ = false;
  sampled_since_advance_ = false;
  describeAxes(now);
  describeRotary(now);
  state_.at = now;
  state_.last_trigger = triggers_.newest();
  state_.unplaced_triggers = triggers_.unplaced();
  state_.clock_locked = map.state == ClockState::locked;
  state_.loss_seen = ledger.lost_at_source != 0 || ledger.lost_in_queue != 0;
}

void Corrections::describeAxes(MonoTime now) {
  bool any_screw = false, all_good = true;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const auto& reference = references_[axis];
    const auto& screw = screws_[axis];
    any_screw = any_screw || screw.fitted();
    all_good = all_good && (!screw.fitted() || screw.sensorGood());
    state_.axes[axis] = {.referenced = reference.referenced(),
                         .homing = reference.homing(now),
                         .position_mm = reference.position_mm().value_or(0),
                         .last_fault = reference.lastFault(),
                         .reference_losses = reference.losses(),
                         .unused_indexes = reference.unusedIndexes(),
                         .screw = {.fitted = screw.fitted(),
                                   .sensor_fault = screw.fault(),
                                   .extension_um = screw.extension_um(),
                                   .offset_mm = screw.offset_mm(),
                                   .slope = screw.slope(),
                                   .reference_um = screw.reference_um()}};
  }
  state_.screw_sensors_good = any_screw && all_good;
  state_.referenced = hasNeededReferences();
  state_.centreline_calibrated = centreline_.calibrated();
  const auto& z = references_[static_cast<std::size_t>(Axis::z)];
  const auto z_mm = z.position_mm();
  // Beyond the time for which the correction is held, Z may be anywhere.
  const bool has_z = z_mm && !z.isSilent(now, kSilence + config_.centreline.hold);
  state_.centreline = {
      .result = centreline_.inForce(),
      .has_z = has_z,
      .here_mm = centreline_.calibrated() && has_z ? centreline_.centreAt(*z_mm) : std::array<double, 2>{}};
}

void Corrections::describeRotary(MonoTime now) {
  for (std::size_t axis = 0; axis < kRotaryAxes; ++axis) {
    const auto& angle = angles_[axis];
    const auto named = static_cast<RotaryAxis>(axis);
    const auto stands = angle.at(now);
    const auto& in_force = rotary_.inForce(named);
    const auto errors = rotary_.errorsAt(named, stands.rad);
    auto& state = state_.rotary[axis];
    state = {.described = angle.described(),
             .known = angle.known(),
             .doubtful = stands.doubtful,
             .angle_rad = stands.rad.value_or(0),
             .last_fault = angle.reference().lastFault(),
             .reference_losses = angle.reference().losses(),
             .result_id = in_force.result_id,
             .has_errors = errors.has_value(),
             .errors = {},
             .sd_errors = in_force.sd};
    for (std::size_t i = 0; errors && i < state.errors.size(); ++i)
      state.errors[i] = (*errors)[static_cast<Eigen::Index>(i)];
  }
  const auto health = swivel_.held().health();
  const bool says = health == Health::good || health == Health::held;
  state_.swivel = {.result_id = swivel_.resultId(), .error_mm = says ? swivel_.held().value() : Vector{}};
  tool_.describe(state_.swivel);
}

// Where no source that is summed needs any, all axes count.
bool Corrections::hasNeededReferences() const {
  bool any = false, all = true;
  forEachSource(*this, [&](const auto& source) {
    if (!sums(source.kKind)) return;
    const auto inputs = source.inputs();
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
      any = any || inputs.positions[axis];
      all = all && (!inputs.positions[axis] || references_[axis].referenced());
    }
    for (std::size_t axis = 0; axis < kRotaryAxes; ++axis) {
      any = any || inputs.angles[axis];
      all = all && (!inputs.angles[axis] || angles_[axis].known());
    }
  });
  return any ? all : std::ranges::all_of(references_, &AxisReference::referenced);
}

}  // namespace probebox::corrections
