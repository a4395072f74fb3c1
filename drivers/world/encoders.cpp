#include "drivers/world/encoders.hpp"

#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::world {
Encoders::Encoders(const Config& config, std::uint64_t seed)
    : config_{config.encoders},
      c_counts_per_deg_{config.rotary.c_counts_per_deg},
      c_power_up_deg_{config.c_power_up_deg},
      tau_s_{config.delays.tau_machine_s},
      random_{seed, RandomStream::encoders},
      sampling_{config.start, config.encoders.rate_hz, random_} {
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) sense_[axis] = config.machine.axes[axis].sense;
  has_y_ = config.machine.has_y;
}

bool Encoders::take(Event& event, const Machine& machine, const Screws& screws, const FaultSchedule& faults,
                    Ledger& ledger) {
  const MonoTime at = nextAt();
  const bool is_linear = axis_ < kLinearAxes;
  if (!faults.active(FaultKind::encoders_stuck, at)) {
    if (is_linear) {
      position_mm_[axis_] = screws.motorPosition_mm(axis_, machine.positionAt(at, tau_s_[axis_])[axis_], at);
    } else {
      angle_rad_ = machine.partAngleAt(at, tau_s_.back());
    }
  }
  event = is_linear ? countOf(axis_, at) : Event{angleCount(at)};
  const bool missed = is_linear ? random_.happens(config_.dropout_probability)  // the same with an angle and without
                                : faults.active(FaultKind::angles_silent, at);
  const bool dropped = missed || faults.active(FaultKind::encoders_silent, at);
  ++ledger.encoder_latches;
  if (dropped) ++ledger.dropped_encoders;
  ++axis_;
  if (axis_ == static_cast<std::size_t>(Axis::y) && !has_y_) ++axis_;
  if (axis_ == axes()) axis_ = 0, ++latch_;
  return !dropped;
}

Event Encoders::countOf(std::size_t axis, MonoTime at) {
  const double position_mm =
      position_mm_[axis] + config_.power_up_mm[axis] + 1e-3 * config_.noise_um * random_.normal();
  return Count{.axis = static_cast<Axis>(axis),
               .sequence = static_cast<std::uint32_t>(latch_),
               .counts = sense_[axis] * std::llround(position_mm * config_.counts_per_mm),
               .at = at};
}

AngleCount Encoders::angleCount(MonoTime at) const {
  const double angle_deg = degrees(angle_rad_) + c_power_up_deg_;
  return {.axis = RotaryAxis::c,
          .sequence = static_cast<std::uint32_t>(latch_),
          .counts = std::llround(angle_deg * c_counts_per_deg_),
          .at = at};
}

}  // namespace probebox::world
