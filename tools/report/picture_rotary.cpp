#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "protocol/units/angle.hpp"
#include "tools/report/names.hpp"
#include "tools/report/pictures.hpp"

namespace probebox::report {
namespace {

namespace quantity = metrology::quantity;

constexpr std::size_t kErrorsOfPose = 6;

Plot against(const Subject& subject, const std::vector<double>& angles, const metrology::Estimate& errors,
             std::size_t first, double factor, const char* title, const char* label) {
  constexpr Look kLooks[]{Look::dots, Look::squares, Look::triangles};
  Plot plot{title, "angle of " + (axisLetter(subject).empty() ? "the axis" : axisLetter(subject)) + " (deg)", label};
  for (std::size_t part = 0; part < 3; ++part) {
    std::vector<Point> points;
    std::vector<double> bars;
    for (std::size_t k = 0; k < angles.size(); ++k) {
      const std::size_t at = kErrorsOfPose * k + first + part;
      points.push_back({degrees(angles[k]), errors.values[at] * factor});
      bars.push_back(2.0 * combinedOf(errors, at).value_or(0.0) * factor);
    }
    plot.addWithBars(std::move(points), bars, kLooks[part], columnName(subject, errors, first + part));
  }
  plot.addLevel(0.0);
  return plot;
}

// The machine's plane that the axis stands on most nearly: two coordinates, and the sense in which the axis turns from
// the first to the second.
struct PlaneAcross {
  std::size_t first{};
  std::size_t second{};
  double sense{1.0};
};

std::optional<PlaneAcross> planeAcross(const Subject& subject) {
  if (!subject.dataset) return std::nullopt;
  const auto entry = subject.dataset->config.find("axis_direction");
  if (entry == subject.dataset->config.end()) return std::nullopt;
  const auto* direction = std::get_if<std::vector<double>>(&entry->second);
  if (direction == nullptr || direction->size() != 3) return std::nullopt;
  const auto longest = std::ranges::max_element(*direction, {}, [](double part) { return std::abs(part); });
  const auto along = static_cast<std::size_t>(longest - direction->begin());
  return PlaneAcross{(along + 1) % 3, (along + 2) % 3, *longest < 0.0 ? -1.0 : 1.0};
}

// Arrows in their own scale around a circle that only has to be large enough.
Plot vectors(const Subject& subject, const std::vector<double>& angles, const metrology::Estimate& errors,
             const PlaneAcross& plane) {
  std::vector<Point> by;
  double longest = 0.0;
  for (std::size_t k = 0; k < angles.size(); ++k) {
    const std::size_t row = kErrorsOfPose * k;
    by.push_back({1e3 * errors.values[row + plane.first], 1e3 * errors.values[row + plane.second]});
    longest = std::max(longest, std::hypot(by.back().x, by.back().y));
  }
  const double radius = std::max(2.5 * longest, 1e-3);
  std::vector<Point> from;
  for (const double angle : angles) {
    from.push_back({radius * std::cos(angle), plane.sense * radius * std::sin(angle)});
  }
  Plot plot{"Error vectors around the axis", columnName(subject, errors, plane.first) + " (um)",
            columnName(subject, errors, plane.second) + " (um)"};
  plot.keepProportions();
  plot.add(circleAround({}, radius), Look::dotted, "angles of the axis; arrows in the scale of the axes");
  plot.addArrows(std::move(from), std::move(by));
  return plot;
}

}  // namespace

std::vector<Plot> rotaryPictures(const Subject& subject) {
  const auto& result = *subject.result();
  const auto* errors = result.find(quantity::kSixErrors.key);
  if (errors == nullptr || errors->columns != kErrorsOfPose) return {};
  const auto* stated = result.find(quantity::kErrorAngles.key);
  if (stated == nullptr) return {};
  const auto& angles = stated->values;
  if (angles.size() * kErrorsOfPose != errors->values.size()) return {};
  std::vector<Plot> plots;
  if (const auto plane = planeAcross(subject)) plots.push_back(vectors(subject, angles, *errors, *plane));
  plots.push_back(against(subject, angles, *errors, 0, 1e3, "Translations, bars of U", "error (um)"));
  plots.push_back(against(subject, angles, *errors, 3, 1e6, "Rotations, bars of U", "error (urad)"));
  return plots;
}

}  // namespace probebox::report
