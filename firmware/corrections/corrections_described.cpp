// What the corrections publish about axes and results in force.
#include <algorithm>

#include "firmware/corrections/corrections.hpp"

namespace probebox::corrections {

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
