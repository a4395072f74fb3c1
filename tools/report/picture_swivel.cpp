#include <cstddef>

#include "firmware/metrology/dataset/quantity.hpp"
#include "firmware/metrology/tilt/swivel_error.hpp"
#include "tools/report/names.hpp"
#include "tools/report/pictures.hpp"

namespace probebox::report {

std::vector<Plot> swivelPictures(const metrology::Dataset& dataset, const metrology::Result& result) {
  const auto* error = result.find(metrology::quantity::kErrorAtQueries.key);
  const auto* queries = dataset.table("queries");
  const auto* swivel = queries == nullptr ? nullptr : queries->column(metrology::column::kB);
  if (error == nullptr || swivel == nullptr || error->columns != 3 || swivel->size() * 3 != error->values.size())
    return {};
  constexpr Look kLooks[]{Look::dots, Look::squares, Look::triangles};
  constexpr const char* kNames[]{"X", "Y", "Z"};
  Plot plot{"Error at the queried angles, bars of U", "B (deg)", "error (um)"};
  for (std::size_t part = 0; part < 3; ++part) {
    std::vector<Point> points;
    std::vector<double> bars;
    for (std::size_t row = 0; row < swivel->size(); ++row) {
      const std::size_t at = 3 * row + part;
      points.push_back({(*swivel)[row], 1e3 * error->values[at]});
      bars.push_back(2e3 * combinedOf(*error, at).value_or(0.0));
    }
    plot.addWithBars(std::move(points), bars, kLooks[part], kNames[part]);
  }
  plot.addLevel(0.0);
  return {plot};
}

}  // namespace probebox::report
