#include <algorithm>
#include <cmath>
#include <cstddef>

#include "firmware/metrology/machine/machine_check.hpp"
#include "protocol/units/angle.hpp"
#include "tools/report/digits.hpp"
#include "tools/report/names.hpp"
#include "tools/report/pictures.hpp"

namespace probebox::report {
namespace {

constexpr double kDrawn = 0.25;  // of the radius: the largest deviation
constexpr int kPointsAround = 180;

struct Direction {
  double azimuth_rad{}, elevation_rad{};
  double found_um{}, u_um{};
};

// Across the stylus, by the lobes of the answer.
double lobesAround(const metrology::Estimate& lobing, double azimuth_rad) {
  double sum_mm = lobing.values.back();
  for (std::size_t k = 0; k + 1 < lobing.values.size(); ++k) {
    const double turns = 2 + static_cast<double>(k / 2);
    sum_mm += lobing.values[k] * (k % 2 == 0 ? std::cos(turns * azimuth_rad) : std::sin(turns * azimuth_rad));
  }
  return 1e3 * sum_mm;
}

}  // namespace

std::vector<Plot> formPictures(const metrology::Result& result) {
  const auto* map = result.find(metrology::quantity::kFormByDirection.key);
  const auto* lobing = result.find(metrology::quantity::kLobing.key);
  if (map == nullptr || lobing == nullptr || map->columns != std::size(metrology::quantity::kFormColumns)) return {};
  std::vector<Direction> directions;
  double largest_um = 0;
  for (std::size_t at = 0; at + map->columns <= map->values.size(); at += map->columns) {
    const auto* row = &map->values[at];
    directions.push_back(
        {row[0] * kDegree, row[1] * kDegree, 1e3 * row[2], 2e3 * combinedOf(*map, at + 2).value_or(0)});
    largest_um = std::max(largest_um, std::abs(directions.back().found_um));
  }
  if (!(largest_um > 0)) return {};
  std::vector<Point> places, deviations, around, by_lobes, equator;
  std::vector<double> bars;
  for (const auto& [azimuth, elevation, found_um, u_um] : directions) {
    const double from_pole = 1 - elevation / (kTurn / 4), drawn = kDrawn * found_um / largest_um;
    places.push_back({from_pole * std::cos(azimuth), from_pole * std::sin(azimuth)});
    deviations.push_back({drawn * std::cos(azimuth), drawn * std::sin(azimuth)});
    if (std::abs(from_pole - 1) > 0.1) continue;
    equator.push_back({azimuth / kDegree, found_um});
    bars.push_back(u_um);
  }
  for (int k = 0; k <= kPointsAround; ++k) {
    const double azimuth = kTurn * (k / static_cast<double>(kPointsAround) - 0.5), um = lobesAround(*lobing, azimuth);
    around.push_back({azimuth / kDegree, um});
    const double radius = 1 + kDrawn * um / largest_um;
    by_lobes.push_back({radius * std::cos(azimuth), radius * std::sin(azimuth)});
  }
  Plot seen{"Form by direction, seen along the stylus: the longest arrow is " + shortly(largest_um, 2) + " um",
            "X (1: across the stylus)", "Y"};
  seen.keepProportions();
  seen.add(circleAround({0, 0}, 1), Look::dotted, "equator");
  seen.add(std::move(by_lobes), Look::solid, "lobes across the stylus");
  seen.add(places, Look::dots);
  seen.addArrows(std::move(places), std::move(deviations), "found, outwards from the sphere");
  Plot across{"Form across the stylus, bars of U", "azimuth from +X to +Y (deg)", "outwards (um)"};
  across.add(std::move(around), Look::solid, "lobes");
  across.addWithBars(std::move(equator), bars, Look::dots, "found");
  across.addLevel(0);
  return {seen, across};
}

}  // namespace probebox::report
