#include <cstddef>
#include <string>

#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/tilt/pivot.hpp"
#include "tools/report/pictures.hpp"

namespace probebox::report {
namespace {

namespace quantity = metrology::quantity;

// The table of places, if the method has one whose rows are places of one feature.
const metrology::Table* placesOf(const metrology::Dataset& dataset) {
  for (const char* name : {"points", "readings", "centres"}) {
    const auto* table = dataset.table(name);
    if (table != nullptr && table->rectangular() && table->rows() > 0) return table;
  }
  return nullptr;
}

// One view: two columns against each other; with a sphere's outline where the answer has one.
Plot view(const metrology::Table& table, const metrology::Result* result, const metrology::Dataset& dataset,
          std::size_t across, std::size_t up) {
  constexpr const char* kLabels[]{"x (mm)", "y (mm)", "z (mm)"};
  Plot plot{std::string{"Where it was read, "} + kLabels[across][0] + " and " + kLabels[up][0], kLabels[across],
            kLabels[up]};
  const auto* x = table.column(metrology::column::kPosition[across]);
  const auto* y = table.column(metrology::column::kPosition[up]);
  if (x == nullptr || y == nullptr) return plot;
  plot.keepProportions();
  std::vector<Point> points;
  for (std::size_t k = 0; k < x->size(); ++k) points.push_back({(*x)[k], (*y)[k]});
  const auto* centre = result == nullptr ? nullptr : result->find(quantity::kCentre.key);
  if (centre != nullptr && centre->values.size() == 3) {
    const Point at{centre->values[across], centre->values[up]};
    const auto* radius = result->find(quantity::kRadius.key);
    const auto known = dataset.config.find("radius_mm");
    if (radius != nullptr) {
      plot.add(circleAround(at, radius->value()), Look::dotted, "sphere");
    } else if (known != dataset.config.end() && std::holds_alternative<double>(known->second)) {
      plot.add(circleAround(at, std::get<double>(known->second)), Look::dotted, "sphere");
    }
    plot.add({at}, Look::triangles, "centre");
  }
  // The pivot of a swivelling head is relative to the moving reference, so it has no place among the readings.
  const auto* readings = dataset.table("readings");
  const bool swivels = readings != nullptr && readings->column(metrology::column::kB) != nullptr;
  for (const auto key : {quantity::kPivotXz.key, quantity::kPivotYz.key, quantity::kPivotXy.key}) {
    const auto* pivot = result == nullptr || swivels ? nullptr : result->find(key);
    const std::string seen{kLabels[across][0], kLabels[up][0]};
    if (pivot != nullptr && std::string{key}.substr(6, 2) == seen) {
      plot.add({{pivot->values[0], pivot->values[1]}}, Look::triangles, "pivot");
    }
  }
  plot.add(std::move(points), Look::dots, "readings");
  return plot;
}

}  // namespace

std::vector<Plot> planePictures(const metrology::Dataset& dataset, const metrology::Result* result) {
  const auto* table = placesOf(dataset);
  if (table == nullptr) return {};
  // Readings around one centre have a picture of their own; those of a swivelling head are all of one place.
  if (dataset.table("queries") != nullptr) return {};
  if (result != nullptr && !turnPictures(dataset, *result).empty()) return {};
  if (table->column(metrology::column::kZ) == nullptr) return {view(*table, result, dataset, 0, 1)};
  const bool about_x = result != nullptr && result->find(quantity::kPivotYz.key) != nullptr;
  if (about_x) return {view(*table, result, dataset, 1, 2)};
  return {view(*table, result, dataset, 0, 1), view(*table, result, dataset, 0, 2)};
}

}  // namespace probebox::report
