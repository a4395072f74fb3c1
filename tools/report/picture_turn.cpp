#include <algorithm>
#include <cmath>
#include <cstdio>

#include "firmware/metrology/dataset/quantity.hpp"
#include "tools/report/pictures.hpp"

namespace probebox::report {
namespace {

namespace quantity = metrology::quantity;

constexpr double kShownShare = 0.2;  // of the radius, that the largest deviation is magnified to

// 1, 2 or 5 times a power of ten, at most this.
double roundBelow(double value) {
  const double power = std::pow(10.0, std::floor(std::log10(value)));
  const double share = value / power;
  return power * (share >= 5.0 ? 5.0 : share >= 2.0 ? 2.0 : 1.0);
}

// Mean distance from the centre.
double meanRadius(const std::vector<Point>& from_centre) {
  double sum = 0.0;
  for (const auto& at : from_centre) sum += std::hypot(at.x, at.y);
  return sum / static_cast<double>(from_centre.size());
}

}  // namespace

std::vector<Plot> turnPictures(const metrology::Dataset& dataset, const metrology::Result& result) {
  const auto* centre = result.find(quantity::kCentre.key);
  const auto* table = dataset.table("readings");
  if (centre == nullptr || centre->values.size() != 2 || table == nullptr || !table->rectangular()) return {};
  const auto* x = table->column(metrology::column::kX);
  const auto* y = table->column(metrology::column::kY);
  if (x == nullptr || y == nullptr || x->empty() || table->column(metrology::column::kZ) != nullptr) return {};
  std::vector<Point> readings;
  for (std::size_t k = 0; k < x->size(); ++k)
    readings.push_back({(*x)[k] - centre->values[0], (*y)[k] - centre->values[1]});
  const double radius = meanRadius(readings);
  double worst = 0.0;
  for (const auto& at : readings) worst = std::max(worst, std::abs(std::hypot(at.x, at.y) - radius));
  if (!(radius > 0.0)) return {};
  const double factor = worst > 1e-12 ? std::max(1.0, roundBelow(kShownShare * radius / worst)) : 1.0;
  std::vector<Point> magnified;
  for (const auto& at : readings) {
    const double r = std::hypot(at.x, at.y);
    const double shown = (radius + factor * (r - radius)) / r;
    magnified.push_back({at.x * shown, at.y * shown});
  }
  Plot plot{"Readings around the centre", "x - centre (mm)", "y - centre (mm)"};
  plot.keepProportions();
  char legend[96];
  std::snprintf(legend, sizeof legend, "readings, off the circle %g times magnified (largest %.2g um)", factor,
                1e3 * worst);
  plot.add(circleAround({}, radius), Look::dotted, "mean radius");
  plot.add(std::move(magnified), Look::dots, legend);
  plot.add({{0.0, 0.0}}, Look::triangles, "centre");
  return {plot};
}

}  // namespace probebox::report
