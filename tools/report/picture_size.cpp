#include <algorithm>
#include <cmath>

#include "firmware/metrology/dataset/quantity.hpp"
#include "tools/report/pictures.hpp"

namespace probebox::report {
namespace {

namespace quantity = metrology::quantity;

// mm along the line, at a speed; the sign that fits: minus for retracts from an external feature.
double slopeOf(const metrology::Estimate& speeds, const metrology::Estimate& sizes, double tau_s, double size_mm) {
  double with_minus = 0.0;
  double with_plus = 0.0;
  for (std::size_t k = 0; k < speeds.values.size(); ++k) {
    const double lag = 2.0 * tau_s * speeds.values[k];
    with_minus += std::abs(sizes.values[k] - (size_mm - lag));
    with_plus += std::abs(sizes.values[k] - (size_mm + lag));
  }
  return with_minus <= with_plus ? -2.0 * tau_s : 2.0 * tau_s;
}

// Expanded uncertainty of the mean size at each speed, from the number of touches at that speed and the sd of one
// touch; a diameter has two normals. Empty where the sd or the touches are unknown.
std::vector<double> barsAt(const std::vector<double>& speeds, const metrology::Estimate& size,
                           const metrology::Result& result) {
  if (size.sd.empty() || size.design.empty() || !(size.design.front() > 0.0)) return {};
  const double sd = size.sd.front() / size.design.front();
  std::vector<double> bars;
  for (const double speed : speeds) {
    const auto at_speed = [&](double normal) { return std::abs(std::abs(normal) - speed) < 0.1 * speed; };
    const auto touches = std::ranges::count_if(result.residuals.at, at_speed);
    if (touches == 0) return {};
    bars.push_back(2.0 * 2.0 * sd / std::sqrt(static_cast<double>(touches)));
  }
  return bars;
}

}  // namespace

std::vector<Plot> sizePictures(const Subject& subject) {
  const auto& result = *subject.result();
  const auto* speeds = result.find("speeds_mm_s");
  const auto* sizes = result.find("sizes_mm");
  const auto* tau = result.find(quantity::kTau.key);
  const auto* size = result.find(quantity::kEffectiveDiameter.key);
  if (speeds == nullptr || sizes == nullptr || tau == nullptr || size == nullptr) return {};
  if (speeds->values.empty() || speeds->values.size() != sizes->values.size()) return {};
  // The delay that the stamps were corrected by is no part of what was measured.
  const auto* left = result.find("residual_tau_s");
  const double slope = slopeOf(*speeds, *sizes, (left != nullptr ? left : tau)->value(), size->value());
  const double fastest = *std::ranges::max_element(speeds->values);
  Plot plot{"Size against speed", "speed (mm/s)", "measured diameter (mm)"};
  Plot off{"Size minus the line", "speed (mm/s)", "off the line (um)"};
  std::vector<Point> measured;
  std::vector<Point> left_over;
  for (std::size_t k = 0; k < speeds->values.size(); ++k) {
    const double speed = speeds->values[k];
    measured.push_back({speed, sizes->values[k]});
    left_over.push_back({speed, 1e3 * (sizes->values[k] - size->value() - slope * speed)});
  }
  plot.add({{0.0, size->value()}, {1.05 * fastest, size->value() + 1.05 * fastest * slope}}, Look::solid,
           "fitted line: the slope is the delay");
  plot.add(std::move(measured), Look::squares, "measured at each speed");
  plot.add({{0.0, size->value()}}, Look::triangles, "intercept: the size without delay");
  if (subject.dataset) {
    const auto known = subject.dataset->config.find("effective_diameter_mm");
    const bool stated = known != subject.dataset->config.end() && std::holds_alternative<double>(known->second);
    if (stated) plot.addLevel(std::get<double>(known->second), "stated size");
  }
  off.include({0.0, 0.0});
  auto bars = barsAt(speeds->values, *size, result);
  for (double& bar : bars) bar *= 1e3;
  off.addWithBars(std::move(left_over), bars, Look::squares, bars.empty() ? "" : "mean of the touches, bars of U");
  off.addLevel(0.0);
  return {plot, off};
}

}  // namespace probebox::report
