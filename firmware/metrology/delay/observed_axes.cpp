#include "firmware/metrology/delay/observed_axes.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <span>
#include <utility>

namespace probebox::metrology {
namespace {

// Less than this share of a drive is no drive along the axis: 13 degrees across it.
constexpr double kAlong = 0.05;

// What each touch shifts along its normal n, in units of its speed, by one second of delay of each axis: n_i u_i with u
// the direction of the drive. No rows without a table of touches.
Eigen::MatrixX3d shiftsOfTouches(const Dataset& dataset) {
  constexpr auto kColumns = std::span{kTouchesColumns}.subspan<1, 6>();
  const Table* touches = dataset.table("touches");
  std::array<const std::vector<double>*, 6> columns{};
  for (std::size_t k = 0; k < kColumns.size(); ++k) {
    if (touches != nullptr) columns[k] = touches->column(kColumns[k]);
    if (columns[k] == nullptr) return Eigen::MatrixX3d{0, 3};
  }
  Eigen::MatrixX3d rows{static_cast<Eigen::Index>(columns[0]->size()), 3};
  for (Eigen::Index i = 0; i < rows.rows(); ++i) {
    const auto at = static_cast<std::size_t>(i);
    for (std::size_t k = 0; k < 3; ++k)
      rows(i, static_cast<Eigen::Index>(k)) = (*columns[k])[at] * (*columns[k + 3])[at];
  }
  return rows;
}

// How far each scan goes along each axis, as a share of its longest way, one axis a row.
Eigen::MatrixX3d waysOfScans(const Dataset& dataset) {
  const Table* machine = dataset.table("machine");
  const auto* scans = machine != nullptr ? machine->column(column::kScan) : nullptr;
  std::array<const std::vector<double>*, 3> positions{};
  for (std::size_t k = 0; k < 3; ++k) {
    if (scans != nullptr) positions[k] = machine->column(column::kPosition[k]);
    if (positions[k] == nullptr) return Eigen::MatrixX3d{0, 3};
  }
  std::map<double, std::array<std::pair<double, double>, 3>> extents;
  for (std::size_t i = 0; i < scans->size(); ++i) {
    const auto [extent, is_first] = extents.try_emplace((*scans)[i]);
    for (std::size_t k = 0; k < 3; ++k) {
      auto& [least, most] = extent->second[k];
      const double at = (*positions[k])[i];
      least = is_first ? at : std::min(least, at);
      most = is_first ? at : std::max(most, at);
    }
  }
  Eigen::MatrixX3d ways = Eigen::MatrixX3d::Zero(static_cast<Eigen::Index>(3 * extents.size()), 3);
  Eigen::Index row = 0;
  for (const auto& [scan, extent] : extents) {
    Eigen::Vector3d way;
    for (std::size_t k = 0; k < 3; ++k) way[static_cast<Eigen::Index>(k)] = extent[k].second - extent[k].first;
    if (way.maxCoeff() > 0.0) ways.block<3, 3>(row, 0).diagonal() = way / way.maxCoeff();
    row += 3;
  }
  return ways;
}

double rms(const Eigen::VectorXd& column) {
  return column.norm() / std::sqrt(static_cast<double>(column.size()));
}

// Tests whether a column is no combination of the others: what others leave of it.
bool standsAlone(const Eigen::MatrixX3d& rows, Eigen::Index axis) {
  std::vector<Eigen::VectorXd> basis;
  const auto left = [&](Eigen::Index k) {
    Eigen::VectorXd column = rows.col(k);
    for (const auto& each : basis) column -= each * each.dot(column);
    return column;
  };
  for (Eigen::Index k = 0; k < 3; ++k) {
    if (k == axis) continue;
    const Eigen::VectorXd other = left(k);
    if (rms(other) > kAlong) basis.emplace_back(other.normalized());
  }
  return rms(left(axis)) > kAlong;
}

}  // namespace

std::optional<Subject> subjectOfDelay(const Dataset& dataset) {
  constexpr Subject kOfAllAxes{SubjectKind::delay, kAllAxes};
  auto rows = shiftsOfTouches(dataset);
  if (rows.rows() == 0) rows = waysOfScans(dataset);
  if (rows.rows() == 0 || !rows.allFinite()) return kOfAllAxes;
  Subject observed{SubjectKind::delay};
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    if (standsAlone(rows, axis)) observed.of |= 1U << axis;
  return observed.of == 0 ? Subject{SubjectKind::delay_oblique} : observed;
}

}  // namespace probebox::metrology
