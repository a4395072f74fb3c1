#include "firmware/corrections/centreline_source.hpp"

namespace probebox::corrections {

std::array<double, 2> CentrelineSource::centreAt(double z_mm) const {
  const double dz_mm = z_mm - in_force_.reference_z_mm;
  return {in_force_.centre_mm[0] + in_force_.slope[0] * dz_mm, in_force_.centre_mm[1] + in_force_.slope[1] * dz_mm};
}

void CentrelineSource::tick(const MachineTick& tick) {
  constexpr auto kZ = static_cast<std::size_t>(Axis::z);
  const auto& z_mm = tick.position_mm[kZ];
  if (!calibrated() || !z_mm) return held_.invalid();
  if (tick.position_doubtful[kZ]) return held_.doubtful(tick.at);
  const auto centre_mm = centreAt(*z_mm);
  Vector value{};
  for (std::size_t i = 0; i < centre_mm.size(); ++i) {
    if (config_.corrected[i]) value[i] = centre_mm[i] - config_.assumed_mm[i];
  }
  held_.good(value);
}

}  // namespace probebox::corrections
