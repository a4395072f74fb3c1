#include <cmath>
#include <cstddef>
#include <string>

#include "tools/report/pictures.hpp"
#include "tools/report/reading_units.hpp"

namespace probebox::report {
namespace {

constexpr std::size_t kMostPictures = 6;

// A table's column against the first one, or against the row where there is only one.
Plot columnPicture(const metrology::Table& table, const metrology::Column& column) {
  const bool alone = table.columns.size() == 1;
  const AxisUnit across = alone ? AxisUnit{"row", 1.0} : axisUnitOf(table.columns.front().name);
  const AxisUnit up = axisUnitOf(column.name);
  Plot plot{"Table " + table.name + ": " + column.name, across.label, up.label};
  std::vector<Point> points;
  for (std::size_t row = 0; row < column.values.size(); ++row) {
    const auto& first = table.columns.front().values;
    const double at = alone || row >= first.size() ? static_cast<double>(row + 1) : first[row] * across.factor;
    points.push_back({at, column.values[row] * up.factor});
  }
  plot.add(std::move(points), Look::dots);
  return plot;
}

}  // namespace

std::vector<Plot> tablePictures(const metrology::Dataset& dataset) {
  std::vector<Plot> all;
  for (const auto& table : dataset.tables) {
    for (std::size_t k = table.columns.size() > 1 ? 1 : 0; k < table.columns.size(); ++k) {
      if (all.size() < kMostPictures) all.push_back(columnPicture(table, table.columns[k]));
    }
  }
  return all;
}

}  // namespace probebox::report
