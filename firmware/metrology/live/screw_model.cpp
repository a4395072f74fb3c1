#include "firmware/metrology/live/screw_model.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

constexpr double kBand = 0.1;  // of the threshold, to either side

// Angle within a turn, in sectors from 0 to count.
double sectorsOf(double angle_rad, std::size_t count) {
  const double turns = angle_rad / kTurn;
  return (turns - std::floor(turns)) * static_cast<double>(count);
}

}  // namespace

double leverOf(const ScrewModel& screw, double position_mm) {
  return screw.reversed ? -(screw.offset_mm - position_mm) / screw.length_mm
                        : (position_mm + screw.offset_mm) / screw.length_mm;
}

double compensationUm(const ScrewModel& screw, double position_mm, double extension_um) {
  return leverOf(screw, position_mm) * screw.gain * extension_um;
}

std::size_t sectorAt(double angle_rad, std::size_t count) {
  // A share that rounds up to a whole turn belongs to the last sector.
  return std::min(static_cast<std::size_t>(sectorsOf(angle_rad, count)), count - 1);
}

double faceErrorUm(const ScrewModel& screw, double angle_rad) {
  const std::size_t count = screw.sector_count;
  if (count == 0) return 0.0;
  const double from_first_centre_rad = angle_rad - kTurn / static_cast<double>(count) / 2;
  const std::size_t before = sectorAt(from_first_centre_rad, count);
  return std::lerp(screw.sector_um[before], screw.sector_um[(before + 1) % count],
                   sectorsOf(from_first_centre_rad, count) - static_cast<double>(before));
}

double extensionUm(const ScrewModel& screw, double angle_rad, double speed_rpm, double sensor_um) {
  const bool slow = std::abs(speed_rpm) < screw.threshold_rpm;
  return sensor_um - screw.reference_um - (slow ? faceErrorUm(screw, angle_rad) : 0.0);
}

double thresholdRpm(unsigned harmonic, double time_constant_s) {
  return 60.0 / (kTurn * static_cast<double>(harmonic) * time_constant_s);
}

double TableShare::at(double speed_rpm, double threshold_rpm) {
  const double speed = std::abs(speed_rpm);
  const double low = (1.0 - kBand) * threshold_rpm;
  const double high = (1.0 + kBand) * threshold_rpm;
  if (speed <= low) {
    in_use_ = true;
    return 1.0;
  }
  if (!(speed < high)) {
    in_use_ = false;
    return 0.0;
  }
  return (high - speed) / (high - low);
}

ScrewCompensator::ScrewCompensator(const ScrewModel& screw, const ScrewLimits& limits)
    : screw_{screw}, limits_{limits} {}

bool ScrewCompensator::usable(const ScrewReading& reading, double extension_um) const {
  return reading.sensor_um && std::isfinite(*reading.sensor_um) && std::isfinite(reading.position_mm) &&
         std::isfinite(reading.angle_rad) && std::isfinite(reading.speed_rpm) &&
         extension_um >= limits_.least_extension_um && extension_um <= limits_.greatest_extension_um;
}

ScrewOutput ScrewCompensator::step(const ScrewReading& reading, double elapsed_s) {
  const double extension = reading.sensor_um.value_or(0.0) - screw_.reference_um;
  if (!usable(reading, extension)) {
    return {.compensation_um = last_um_.value_or(0.0),
            .extension_um = extension_um_,
            .table_used = share_.inUse(),
            .held = true};
  }
  const double share = share_.at(reading.speed_rpm, screw_.threshold_rpm);
  extension_um_ = extension - share * faceErrorUm(screw_, reading.angle_rad);
  double used_um = extension_um_;
  if (used_um_ && limits_.rate_um_s > 0.0) {
    const double most = limits_.rate_um_s * std::max(elapsed_s, 0.0);
    used_um = std::clamp(used_um, *used_um_ - most, *used_um_ + most);
  }
  used_um_ = used_um;
  last_um_ = compensationUm(screw_, reading.position_mm, used_um);
  return {.compensation_um = *last_um_,
          .extension_um = extension_um_,
          .table_used = share_.inUse(),
          .held = false,
          .rate_limited = used_um != extension_um_};
}

}  // namespace probebox::metrology
