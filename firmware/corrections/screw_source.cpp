#include "firmware/corrections/screw_source.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::corrections {

ScrewSource::ScrewSource(const ScrewConfig& config, std::size_t axis)
    : config_{config},
      axis_{axis},
      model_{config.model},
      compensator_{config.model, config.limits},
      held_{config.hold} {
  if (config.fitted) held_.invalid();
}

void ScrewSource::push(const Drift& drift) {
  reading_um_ = drift.reading_nm * 1e-3;
  reading_at_ = drift.at;
}

void ScrewSource::push(const ScrewActivated& activated) {
  ++results_;
  const double reference_um = model_.reference_um;
  model_ = config_.model;
  model_.reference_um = reference_um;
  if (activated.result_id != 0) {
    if (activated.gain != 0) model_.gain = -activated.gain;
    model_.sector_count = std::min<std::size_t>(activated.sectors, kMostScrewSectors);
    for (std::size_t i = 0; i < model_.sector_count; ++i) model_.sector_um[i] = activated.sector_nm[i] * 1e-3;
  }
  compensator_ = metrology::ScrewCompensator{model_, config_.limits};
}

void ScrewSource::push(const ScrewReferenceActivated& activated) {
  ++results_;
  model_.reference_um = activated.result_id != 0 ? activated.reading_um : config_.model.reference_um;
  compensator_ = metrology::ScrewCompensator{model_, config_.limits};
}

std::optional<double> ScrewSource::freshReading(MonoTime now) {
  if (!reading_um_) {
    if (fault_ == SensorFault::none) fault_ = SensorFault::silent;
    return std::nullopt;
  }
  if (now - reading_at_ > config_.stale) {
    fault_ = SensorFault::silent;
    return std::nullopt;
  }
  const double extension_um = *reading_um_ - model_.reference_um;
  const bool inside =
      extension_um >= config_.limits.least_extension_um && extension_um <= config_.limits.greatest_extension_um;
  fault_ = inside ? SensorFault::none : SensorFault::out_of_range;
  if (!inside) return std::nullopt;
  believed_at_ = now;
  return reading_um_;
}

void ScrewSource::tick(const MachineTick& tick) {
  if (!config_.fitted) return;
  const auto sensor_um = freshReading(tick.at);
  if (!tick.position_mm[axis_]) {
    // Nobody knows which part of the face the sensor looks at.
    if (sensor_um) extension_um_ = *sensor_um - model_.reference_um;
    return held_.invalid();
  }
  if (tick.position_doubtful[axis_]) return held_.doubtful(tick.at);
  const double position_mm = *tick.position_mm[axis_];
  // The screw went on without a position or a reading.
  const auto since = stepped_at_ ? tick.at - *stepped_at_ : Nanoseconds{};
  const auto output =
      compensator_.step({.position_mm = position_mm,
                         .angle_rad = kTurn * (position_mm - config_.angle_zero_mm) / config_.model.pitch_mm,
                         .speed_rpm = 60 * std::abs(tick.speed_mm_s[axis_]) / config_.model.pitch_mm,
                         .sensor_um = sensor_um},
                        std::chrono::duration<double>{since}.count());
  if (output.held) return held_.doubtful(tick.at);
  stepped_at_ = tick.at;
  extension_um_ = output.extension_um;
  Vector value{};
  value[axis_] = output.compensation_um * 1e-3;
  held_.good(value);
}

bool ScrewSource::extensionKnown(MonoTime now) const {
  return !config_.fitted || (believed_at_ && now - *believed_at_ <= config_.hold);
}

double ScrewSource::offset_mm() const {
  return config_.fitted ? metrology::compensationUm(model_, 0, extension_um_) * 1e-3 : 0;
}

double ScrewSource::slope() const {
  if (!config_.fitted) return 0;
  return metrology::compensationUm(model_, 1, extension_um_) * 1e-3 - offset_mm();
}

SourceInputs ScrewSource::inputs() const {
  SourceInputs inputs;
  inputs.positions.at(axis_) = fitted();
  return inputs;
}

}  // namespace probebox::corrections
