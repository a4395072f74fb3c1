#include "firmware/metrology/centre_height.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace probebox::metrology {
namespace {

const Estimate* slopeOf(const Result& result) {
  const auto* of_spindle = result.find("C_tilt_rad");
  return of_spindle != nullptr ? of_spindle : result.find("Z_slide_rad");
}

void widen(std::vector<double>& sd, const std::vector<double>& of_slope, double up_mm) {
  for (std::size_t i = 0; i < std::min(sd.size(), of_slope.size()); ++i) sd[i] = std::hypot(sd[i], of_slope[i] * up_mm);
}

}  // namespace

void moveCentre(double z_mm, const Result& of, const Result& beside, Estimate& centre) {
  const auto* height = of.find("mean_z_mm");
  const auto* slope = slopeOf(of) != nullptr ? slopeOf(of) : slopeOf(beside);
  if (height == nullptr || slope == nullptr) return;
  const double up_mm = z_mm - height->value();
  for (std::size_t i = 0; i < std::min(centre.values.size(), slope->values.size()); ++i)
    centre.values[i] += slope->values[i] * up_mm;
  widen(centre.sd, slope->sd, up_mm);
  widen(centre.uncertainty, slope->uncertainty.empty() ? slope->sd : slope->uncertainty, up_mm);
}

}  // namespace probebox::metrology
