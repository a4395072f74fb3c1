#include "firmware/metrology/tilt/swivel_lengths.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstddef>

#include "firmware/metrology/dataset/machine_plane.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;

std::vector<double> lengthsIn(const Table& readings) {
  std::vector<double> lengths;
  for (const double length : *readings.column(column::kToolLength)) {
    if (std::ranges::find(lengths, length) == lengths.end()) lengths.push_back(length);
  }
  return lengths;
}

bool hasAngles(const Table* table) {
  return table != nullptr && table->column(column::kB) != nullptr && table->column(column::kToolLength) != nullptr;
}

}  // namespace

std::vector<Table> movedByLength(const Dataset& dataset, std::string_view sd_key) {
  const auto plane = swivelPlane(dataset, "swivel_axis");
  const Table* readings = dataset.table("readings");
  if (!plane || !hasAngles(readings)) return {};
  const auto lengths = lengthsIn(*readings);
  const auto tool = static_cast<std::size_t>(std::ranges::find(kLengthsOfSwivel, sd_key, &KnownQuantity::sd_key) -
                                             kLengthsOfSwivel.begin());
  if (tool >= lengths.size()) return {};
  const Vector3d axis = plane->sense * Vector3d::Unit(plane->axis);
  const Vector3d level{0, 0, -1};
  std::vector<Table> moves;
  for (const Table* table : {readings, dataset.table("shank")}) {
    if (!hasAngles(table)) continue;
    const auto& angles = *table->column(column::kB);
    auto& move = moves.emplace_back(Table::withColumns(table->name, column::kPosition));
    for (std::size_t row = 0; row < angles.size(); ++row) {
      const bool of_tool = table == readings ? (*table->column(column::kToolLength))[row] == lengths[tool] : tool == 0;
      const Vector3d by = level - Eigen::AngleAxisd{angles[row] * kDegree, axis} * level;
      const double share = of_tool ? 1.0 : 0.0;
      move.append({share * by.x(), share * by.y(), share * by.z()});
    }
  }
  return moves;
}

}  // namespace probebox::metrology
