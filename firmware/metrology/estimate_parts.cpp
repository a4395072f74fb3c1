#include "firmware/metrology/estimate_parts.hpp"

namespace probebox::metrology {

std::vector<EstimatePart> partsOf(const Estimate& estimate) {
  constexpr std::size_t kErrors = 6;
  const bool two_units = estimate.key == "six_errors" && estimate.columns == kErrors;
  std::vector<EstimatePart> parts{{estimate.key, {}}};
  if (two_units) parts = {{"translations_mm", {}}, {"rotations_rad", {}}};
  for (std::size_t k = 0; k < estimate.values.size(); ++k) {
    parts[two_units && k % kErrors >= kErrors / 2 ? 1 : 0].at.push_back(k);
  }
  return parts;
}

}  // namespace probebox::metrology
