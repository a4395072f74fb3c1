#include "drivers/world/screws.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::world {
Screws::Screws(const Config& config, std::uint64_t seed)
    : start_{config.start}, interval_{std::llround(1e9 / config.drift_rate_hz)}, random_{seed, RandomStream::screws} {
  for (std::size_t axis = 0; axis < screws_.size(); ++axis) {
    const auto& warming = config.screws[axis];
    const auto& described = config.machine.screws[axis];
    if (warming && described) screws_[axis] = {*warming, *described}, any_ = true;
  }
}

MonoTime Screws::nextAt() const {
  return any_ ? start_ + interval_ * (reading_ + 1) : MonoTime::max();
}

double Screws::extension_um(std::size_t axis, MonoTime at) const {
  if (!screws_[axis]) return 0;
  const auto& screw = screws_[axis]->warming;
  const double warm = 1 - std::exp(-toSeconds(at - start_) / screw.time_constant_s);
  return screw.cold_um + (screw.warm_um - screw.cold_um) * warm;
}

double Screws::lever(std::size_t axis, double position_mm) const {
  const BallScrew& screw = screws_[axis]->described;
  return screw.reversed ? -(screw.offset_mm - position_mm) / screw.length_mm
                        : (position_mm + screw.offset_mm) / screw.length_mm;
}

// The same by the warmth of the parts before the nut. Beyond its ends the screw is as warm as there.
double Screws::unevenLever(std::size_t axis, double position_mm) const {
  const auto& shares = screws_[axis]->warming.heat_shares;
  const double even = lever(axis, position_mm);
  if (shares.size() == 1) return even;
  double left = std::abs(even) * static_cast<double>(shares.size()), before = 0, all = 0;
  for (std::size_t i = 0; i < shares.size(); ++i) {
    const double within = i + 1 < shares.size() ? std::min(left, 1.0) : left;
    before += shares[i] * within;
    left -= within;
    all += shares[i];
  }
  return std::copysign(before / all, even);
}

double Screws::nutError_mm(std::size_t axis, double position_mm, MonoTime at) const {
  if (!screws_[axis]) return 0;
  return unevenLever(axis, position_mm) * extension_um(axis, at) * 1e-3;
}

double Screws::nutPosition_mm(std::size_t axis, double motor_mm, MonoTime at) const {
  double nut_mm = motor_mm;
  // The error depends on where the nut is by a ten-thousandth, so each round leaves that much of what the last one
  // left.
  for (int round = 0; round < 3; ++round) nut_mm = motor_mm + nutError_mm(axis, nut_mm, at);
  return nut_mm;
}

// The sum of two harmonics of the screw's turn, as a face that is cut askew and a little bent gives.
double Screws::face_um(std::size_t axis, double motor_mm) const {
  const auto& [warming, described] = *screws_[axis];
  const double turn = kTurn * motor_mm / described.pitch_mm;
  return warming.face_um[0] * std::cos(turn - 0.4) + warming.face_um[1] * std::cos(2 * turn - 1.9);
}

bool Screws::take(Event& event, const Machine& machine, const FaultSchedule& faults, Ledger& ledger) {
  const MonoTime at = nextAt();
  bool given = screws_[axis_].has_value();
  if (given) {
    const auto& [warming, described] = *screws_[axis_];
    const double motor_mm = motorPosition_mm(axis_, machine.positionAt(at)[axis_], at);
    // A sensor that cannot follow the turns sees their mean.
    const double turns_s = machine.speedAt(at) / described.pitch_mm;
    const double seen = 1 / std::hypot(1.0, kTurn * turns_s * warming.sensor_time_constant_s);
    const double reading_um = described.reference_um + extension_um(axis_, at) + seen * face_um(axis_, motor_mm) +
                              warming.noise_um * random_.normal();
    event = Drift{static_cast<Axis>(axis_), static_cast<std::int32_t>(std::lround(reading_um * 1e3)), at};
    ++ledger.drift_readings;
    if (faults.active(FaultKind::screw_sensors_silent, at)) {
      ++ledger.dropped_drift;
      given = false;
    }
  }
  if (++axis_ == screws_.size()) axis_ = 0, ++reading_;
  return given;
}

}  // namespace probebox::world
