#include "firmware/modbus/register_image.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::modbus {
namespace {

// Counters go round; everything else saturates.
double modulo32(std::uint64_t counter) {
  return static_cast<double>(counter & 0xFFFFFFFFU);
}

std::uint16_t statusOf(const published::Snapshot& s) {
  unsigned status = 0;
  if (s.valid) status |= kValid;
  if (s.clock_locked) status |= kClockLocked;
  if (s.delay.calibrated) status |= kDelayCalibrated;
  if (s.centreline_calibrated) status |= kCentrelineCalibrated;
  if (s.screw_sensors_good) status |= kScrewSensorsGood;
  if (s.degraded) status |= kDegraded;
  if (s.loss_seen) status |= kLossSeen;
  if (s.referenced) status |= kReferenced;
  return static_cast<std::uint16_t>(status);
}

}  // namespace

RegisterImage::RegisterImage() {
  fill({}, WordOrder::high_first);
}

void RegisterImage::put(std::size_t address, double value) {
  // Every address here is one of the map's; the test of the image would not get past a null.
  const auto at = static_cast<std::uint16_t>(address);
  encodeAt(*find(at), at, value, order_, image_);
}

void RegisterImage::putTriple(std::size_t address, const std::array<double, 3>& values, double factor) {
  const auto step = registersOf(find(static_cast<std::uint16_t>(address))->kind);
  for (std::size_t axis = 0; axis < values.size(); ++axis) put(address + axis * step, values[axis] * factor);
}

void RegisterImage::fill(const published::Snapshot& snapshot, WordOrder order) {
  order_ = order;
  put(address::magic, kMagic);
  put(address::map_version, kMapVersion);
  put(address::sequence, snapshot.sequence);
  put(address::heartbeat, snapshot.heartbeat);
  put(address::age, static_cast<double>(snapshot.age_ms / 100) * 0.1);
  put(address::mask, snapshot.mask);
  putCorrections(snapshot);
  putDelay(snapshot.delay);
  putSources(snapshot);
  putCentreline(snapshot.centreline);
  putAxes(snapshot);
  putTrigger(snapshot.last_trigger);
  put(address::triggers_unplaced, snapshot.unplaced_triggers & 0xFFFFU);
  putRotary(snapshot);
  putState(snapshot);
}

void RegisterImage::putSources(const published::Snapshot& snapshot) {
  using published::Health;
  unsigned good = 0, held = 0, invalid = 0;
  for (std::size_t kind = 0; kind < published::kSourceKinds; ++kind) {
    const unsigned bit = 1U << kind;
    if (snapshot.health[kind] == Health::good) good |= bit;
    if (snapshot.health[kind] == Health::held) held |= bit;
    if (snapshot.health[kind] == Health::invalid) invalid |= bit;
  }
  put(address::sources_good, good);
  put(address::sources_held, held);
  put(address::sources_invalid, invalid);
  put(address::inhibited, snapshot.inhibited ? 1 : 0);
  put(address::settled, snapshot.settled ? 1 : 0);
  put(address::refused_homings, snapshot.refused_homings & 0xFFFFU);
}

void RegisterImage::putCentreline(const published::CentrelineInForce& centreline) {
  const auto& result = centreline.result;
  const auto putPair = [this](std::size_t address, const std::array<double, 2>& values) {
    put(address, values[0]);
    put(address + 2, values[1]);
  };
  putPair(address::centreline_here, centreline.has_z ? centreline.here_mm : std::array<double, 2>{});
  putPair(address::centreline_slope, result.slope);
  putPair(address::centreline_sd, result.sd_centre_mm);
  putPair(address::centreline_slope_sd, result.sd_slope);
  put(address::centreline_z, result.reference_z_mm);
  put(address::centreline_result, modulo32(result.result_id));
}

void RegisterImage::putAxes(const published::Snapshot& snapshot) {
  unsigned referenced = 0;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const auto& state = snapshot.axes[axis];
    if (state.referenced) referenced |= 1U << axis;
    put(address::axes_fault + axis, static_cast<double>(state.last_fault));
    put(address::screw_offset + 2 * axis, state.screw_offset_mm);
    put(address::screw_slope + 2 * axis, state.screw_slope);
    put(address::screw_reference + 2 * axis, 0);
    put(address::screw_cold_reading + 2 * axis, state.screw_reference_um);
    put(address::screw_extension + axis, state.extension_um);
    put(address::screw_fault + axis, state.has_screw ? static_cast<double>(state.sensor_fault) : 0);
  }
  put(address::axes_referenced, referenced);
}

void RegisterImage::putRotary(const published::Snapshot& snapshot) {
  unsigned known = 0, doubtful = 0, with_errors = 0;
  for (std::size_t axis = 0; axis < kRotaryAxes; ++axis) {
    const auto& state = snapshot.rotary[axis];
    const unsigned bit = 1U << axis;
    if (state.known) known |= bit;
    if (state.doubtful) doubtful |= bit;
    if (state.has_errors) with_errors |= bit;
    put(address::angle + 2 * axis, state.known ? degrees(state.angle_rad) : 0);
    put(address::rotary_result + 2 * axis, modulo32(state.result_id));
    for (std::size_t i = 0; i < state.errors.size(); ++i) {
      const std::size_t offset = 2 * (axis * state.errors.size() + i);
      put(address::rotary_errors + offset, state.has_errors ? state.errors[i] : 0);
      put(address::rotary_errors_sd + offset, state.sd_errors[i]);
    }
  }
  put(address::angles_known, known);
  put(address::angles_doubtful, doubtful);
  put(address::rotary_known, with_errors);
  const auto& swivel = snapshot.swivel;
  put(address::tool, swivel.tool);
  put(address::tool_length, swivel.tool_length_mm);
  put(address::swivel_result, modulo32(swivel.result_id));
  putTriple(address::swivel_error, swivel.error_mm, 1);
}

void RegisterImage::putTrigger(const published::TriggerStamp& trigger) {
  const auto& served = trigger.served;
  unsigned state = served.valid ? 1U : 0U;
  if (served.degraded) state |= 2U;
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    if (trigger.has_position[axis]) state |= 16U << axis;
    put(address::trigger_position + 2 * axis, trigger.has_position[axis] ? trigger.position_mm[axis] : 0);
    put(address::trigger_correction + 2 * axis, served.correction_nm[axis]);
  }
  put(address::trigger_count, trigger.number);
  put(address::trigger_state, state);
  put(address::trigger_sequence, served.sequence);
}

void RegisterImage::putCorrections(const published::Snapshot& snapshot) {
  unsigned status = statusOf(snapshot);
  for (std::size_t axis = 0; axis < served_mm_.size(); ++axis) {
    const double wanted = snapshot.correction_mm[axis];
    if (std::isfinite(wanted)) {
      served_mm_[axis] = std::clamp(wanted, -kCorrectionLimitMm, kCorrectionLimitMm);
    } else {
      status &= ~static_cast<unsigned>(kValid);
    }
    if (served_mm_[axis] != wanted) status |= kDegraded;
  }
  put(address::status, status);
  putTriple(address::correction_i16, served_mm_, 1e3);
  putTriple(address::correction_offset, served_mm_, 1e3);
  putTriple(address::correction_f32, served_mm_, 1);
  putTriple(address::correction_i32, served_mm_, 1e6);
}

void RegisterImage::putDelay(const published::DelayInForce& delay) {
  const auto in_force = delay.result_id != 0 ? delay : published::DelayInForce{};
  putTriple(address::delay_f32, in_force.tau_s, 1e3);
  putTriple(address::delay_sd_f32, in_force.sd_s, 1e3);
  putTriple(address::delay_i32, in_force.tau_s, 1e9);
  putTriple(address::delay_sd_i32, in_force.sd_s, 1e9);
  put(address::delay_result, modulo32(in_force.result_id));
}

void RegisterImage::putState(const published::Snapshot& snapshot) {
  put(address::calibration_state, static_cast<double>(snapshot.calibration));
  put(address::calibration_method, snapshot.calibration_method);
  put(address::calibration_run, snapshot.calibration_run);
  put(address::calibration_step, snapshot.calibration_step);
  put(address::calibration_steps, snapshot.calibration_steps);
  put(address::calibration_result, modulo32(snapshot.calibration_result_id));
  put(address::clock_state, static_cast<double>(snapshot.clock_state));
  put(address::clock_sigma, snapshot.clock_sigma_ns);
  put(address::samples_produced, modulo32(snapshot.produced_samples));
  put(address::samples_lost_at_source, modulo32(snapshot.lost_at_source_samples));
  put(address::samples_lost_in_queue, modulo32(snapshot.lost_in_queue_samples));
}

}  // namespace probebox::modbus
