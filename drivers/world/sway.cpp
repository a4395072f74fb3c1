#include "drivers/world/sway.hpp"

#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::world {

Sway::Sway(const Config& config, Vibrates what, const board::WorldDrift& drift) : start_{config.start}, drift_{drift} {
  for (const auto& line : config.vibrations)
    if (line.of == what || (what == Vibrates::body && line.of == Vibrates::axes))
      lines_.push_back({line.amplitude_mm * unit(line.direction), kTurn * line.frequency_hz});
  none_ = lines_.empty() && drift.rate_mm_min == Vector3{};
}

Vector3 Sway::at(MonoTime at, double delay_s) const {
  if (none_) return {};
  const double since_s = toSeconds(at - start_) - delay_s, constant_s = drift_.time_constant_s;
  const double drifts_s = constant_s > 0 ? constant_s * -std::expm1(-since_s / constant_s) : since_s;
  Vector3 sum = drifts_s / 60 * drift_.rate_mm_min;
  for (const auto& line : lines_) sum = sum + std::sin(line.rad_s * since_s) * line.amplitude_mm;
  return sum;
}

}  // namespace probebox::world
