#include "tools/report/reading_units.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/metrology/dataset/column.hpp"
#include "protocol/units/angle.hpp"
#include "tools/case/readable.hpp"

namespace probebox::report {

AxisUnit axisUnitOf(std::string_view key) {
  if (key == metrology::column::kTime.name) return {"time (s)", 1.0};
  const std::string name{key};
  if (name.ends_with("_rad")) return {name.substr(0, name.size() - 4) + " (deg)", 1.0 / kDegree};
  if (name.ends_with("_deg")) return {name.substr(0, name.size() - 4) + " (deg)", 1.0};
  auto [label, unit, factor] = casefolder::labelOf(name);
  std::ranges::replace(label, '_', ' ');
  return {unit.empty() ? label : label + " (" + unit + ")", factor};
}

AxisUnit fineUnit(const std::string& quantity, std::string_view unit, const std::vector<double>& values) {
  double largest = 0.0;
  for (const double value : values) {
    if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  }
  const bool small = largest < 0.1;
  if (unit == "mm" && small) return {quantity + " (um)", 1e3};
  if (unit == "rad" && small) return {quantity + " (urad)", 1e6};
  return {quantity + " (" + std::string{unit} + ")", 1.0};
}

}  // namespace probebox::report
