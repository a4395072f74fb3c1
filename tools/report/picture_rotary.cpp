#include <algorithm>
#include <cmath>
#include <numbers>

#include "tools/report/pictures.hpp"

namespace probebox::report {
namespace {

constexpr double kDegrees = 180.0 / std::numbers::pi;
constexpr std::size_t kErrors = 6;

Plot against(const std::vector<double>& angles, const metrology::Estimate& errors, std::size_t first, double factor,
             const char* title, const char* label, const char* const (&names)[3]) {
  constexpr Look kLooks[]{Look::dots, Look::squares, Look::triangles};
  Plot plot{title, "angle (deg)", label};
  for (std::size_t part = 0; part < 3; ++part) {
    std::vector<Point> points;
    std::vector<double> bars;
    for (std::size_t k = 0; k < angles.size(); ++k) {
      const std::size_t at = kErrors * k + first + part;
      points.push_back({angles[k] * kDegrees, errors.values[at] * factor});
      bars.push_back(errors.sd.empty() ? 0.0 : 2.0 * errors.sd[at] * factor);
    }
    plot.addWithBars(std::move(points), bars, kLooks[part], names[part]);
  }
  plot.addLevel(0.0);
  return plot;
}

// Arrows in their own scale around a circle that only has to be large enough.
Plot vectors(const std::vector<double>& angles, const metrology::Estimate& errors) {
  std::vector<Point> by;
  double longest = 0.0;
  for (std::size_t k = 0; k < angles.size(); ++k) {
    by.push_back({1e3 * errors.values[kErrors * k], 1e3 * errors.values[kErrors * k + 1]});
    longest = std::max(longest, std::hypot(by.back().x, by.back().y));
  }
  const double radius = std::max(2.5 * longest, 1e-3);
  std::vector<Point> from;
  for (const double angle : angles) from.push_back({radius * std::cos(angle), radius * std::sin(angle)});
  Plot plot{"Error vectors around the axis", "EX (um)", "EY (um)"};
  plot.keepProportions();
  plot.add(circleAround({}, radius), Look::dotted, "angles of the axis; arrows in the scale of the axes");
  plot.addArrows(std::move(from), std::move(by));
  return plot;
}

}  // namespace

std::vector<Plot> rotaryPictures(const metrology::Result& result) {
  const auto* errors = result.find("six_errors");
  if (errors == nullptr || errors->columns != kErrors) return {};
  const auto* stated = result.find("angle_rad");
  if (stated == nullptr) return {};
  const auto& angles = stated->values;
  if (angles.size() * kErrors != errors->values.size()) return {};
  return {vectors(angles, *errors),
          against(angles, *errors, 0, 1e3, "Translations, bars of 2 sd", "error (um)", {"EX", "EY", "EZ"}),
          against(angles, *errors, 3, 1e6, "Rotations, bars of 2 sd", "error (urad)", {"EA", "EB", "EC"})};
}

}  // namespace probebox::report
