#include <algorithm>
#include <cmath>

#include "tools/report/pictures.hpp"
#include "tools/report/reading_sd.hpp"
#include "tools/report/reading_units.hpp"

namespace probebox::report {
namespace {

constexpr std::size_t kMostDots = 150;

// Readings at one commanded speed differ in the measured one by its noise.
bool allAtOnePlace(const metrology::Residuals& residuals) {
  const double alike = residuals.against == "normal_speed_mm_s" ? 0.01 : 1e-9;
  const auto [least, greatest] = std::ranges::minmax(residuals.at);
  return greatest - least <= alike * std::max(1.0, std::abs(greatest));
}

// Part of a name after its last comma: "x_mm" of "readings 3, x_mm".
std::string partOf(const std::string& name) {
  const auto comma = name.rfind(", ");
  if (comma == std::string::npos) return {};
  const std::string part = name.substr(comma + 2);
  return part.ends_with("_mm") ? part.substr(0, part.size() - 3) : part;
}

}  // namespace

std::vector<Plot> residualPictures(const metrology::Result& result) {
  const auto& residuals = result.residuals;
  if (residuals.values.empty() || result.dof == 0) return {};  // as many unknowns as readings leave nothing
  const bool by_number = allAtOnePlace(residuals);
  const AxisUnit across = by_number ? AxisUnit{"number of the reading", 1.0} : axisUnitOf(residuals.against);
  const AxisUnit up = fineUnit("read minus fitted", residuals.unit, residuals.values);
  Plot plot{"Residuals by reading", across.label, up.label};
  // Up to three coordinates of a reading are drawn apart; where there are more, all alike.
  std::vector<std::string> parts;
  for (const auto& name : residuals.names) {
    if (std::ranges::find(parts, partOf(name)) == parts.end()) parts.push_back(partOf(name));
  }
  const bool apart = parts.size() <= 3;
  std::ranges::sort(parts);  // x, y, z, whichever was read first
  if (!apart) parts = {""};
  constexpr Look kDots[]{Look::dots, Look::squares, Look::triangles};
  const bool many = residuals.values.size() > kMostDots;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    std::vector<Point> points;
    for (std::size_t k = 0; k < residuals.values.size(); ++k) {
      if (apart && partOf(residuals.names[k]) != parts[part]) continue;
      const double at = by_number ? static_cast<double>(k + 1) : residuals.at[k] * across.factor;
      points.push_back({at, residuals.values[k] * up.factor});
    }
    plot.add(std::move(points), many && parts.size() == 1 ? Look::specks : kDots[part], parts[part]);
  }
  plot.addLevel(0.0);
  if (const auto sd = readingSd(result)) {
    plot.addLevel(2.0 * *sd * up.factor, "2 sd of one reading");
    plot.addLevel(-2.0 * *sd * up.factor);
  } else if (residuals.unit == "mm") {
    plot.addLevel(2.0 * result.rms * up.factor, "twice the root mean square of all residuals");
    plot.addLevel(-2.0 * result.rms * up.factor);
  }
  return {plot};
}

}  // namespace probebox::report
