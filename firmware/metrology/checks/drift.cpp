#include "firmware/metrology/checks/drift.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/read_times.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/machine_accuracy.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Duration of the readings; nothing where no time is stated.
std::optional<double> minutesOf(const Table& table, const Dataset& dataset) {
  const auto each_s = configPositive(dataset, kReadingTime);
  const bool is_stated = each_s && *each_s;
  if (!is_stated && !areStamped(table)) return std::nullopt;
  const auto [first, last] = std::ranges::minmax(readTimes(table, is_stated ? **each_s : 1));
  return (last - first) / 60;
}

// True of two readings of one pose: of all that is set for them the same, whole turns aside, and of one place. Stops
// are counted and not set.
bool areOfOnePose(const Table& table, const Method& method, std::size_t one, std::size_t other) {
  constexpr double kSameAngle = 1e-4;  // rad or degrees
  constexpr double kSamePlace_mm = 0.5;
  return std::ranges::all_of(table.columns, [&](const Column& column) {
    const auto role = columnOf(method, table.name, column.name).role;
    const double apart = std::abs(column.values[one] - column.values[other]);
    if (isCoordinate(role)) return apart < kSamePlace_mm;
    if (role == ColumnRole::angle)
      return std::abs(std::remainder(apart, isInDegrees(column.name) ? 360 : kTurn)) < kSameAngle;
    const bool is_set = role == ColumnRole::given || role == ColumnRole::number;
    return !is_set || column.name == column::kStop.name || apart == 0;
  });
}

// True where times are stated and a pose is read twice, half the duration apart or more: such a run shows its drift.
bool closes(const Table& table, const Method& method, const Dataset& dataset) {
  if (!minutesOf(table, dataset)) return false;
  const auto times = readTimes(table, 1);
  const auto [first, last] = std::ranges::minmax(times);
  for (std::size_t row = 0; row < times.size(); ++row) {
    for (std::size_t before = 0; before < row; ++before) {
      const bool is_long_ago = std::abs(times[row] - times[before]) >= 0.5 * (last - first);
      if (is_long_ago && areOfOnePose(table, method, row, before)) return true;
    }
  }
  return false;
}

// "x_mm" drifts as "drift_x_um_per_min".
Estimate rateOf(std::string_view column, double mm_per_min, double sd_mm_per_min) {
  const auto name = column.substr(0, column.rfind('_'));
  return Estimate::scalar("drift_" + std::string{name} + "_um_per_min", 1e3 * mm_per_min, 1e3 * sd_mm_per_min);
}

// Adds to a column what grows by `by` from the first reading to the last, and is nothing in the middle.
void addDrift(Dataset& dataset, const std::string& table, std::string_view column, double by) {
  auto& values = *columnValues(dataset, table, column);
  const auto times = readTimes(*dataset.table(table), 1);
  const auto [first, last] = std::ranges::minmax(times);
  for (std::size_t row = 0; row < values.size(); ++row)
    values[row] += by * ((times[row] - first) / (last - first) - 0.5);
}

// Change of the residuals by a drift of each coordinate of a table, by one mm.
struct DriftDesign {
  std::vector<std::string_view> columns;
  MatrixXd changes;
};

DriftDesign driftDesign(const Residue& before, const Method& method, const std::string& table) {
  constexpr double kStep_mm = 1e-3;
  constexpr double kSeen = 0.05;  // of the drift's own size, or the other unknowns hide it
  DriftDesign design{{}, MatrixXd{before.values().size(), 0}};
  const auto rows = static_cast<double>(before.dataset.table(table)->rows());
  for (const auto& [column, values] : before.dataset.table(table)->columns) {
    if (!before.isCoordinate(table, column)) continue;
    Dataset moved = before.dataset;
    addDrift(moved, table, column, kStep_mm);
    const auto after = residueOf(moved, method);
    if (!after || after->dof != before.dof || after->values().size() != before.values().size()) continue;
    const VectorXd change = (after->values() - before.values()) / kStep_mm;
    if (change.norm() < kSeen * std::sqrt(rows / 12)) continue;
    design.columns.push_back(column);
    design.changes.conservativeResize(Eigen::NoChange, design.changes.cols() + 1);
    design.changes.rightCols(1) = change;
  }
  return design;
}

// What the machine drifts by in that time (k = 1), as stated or cautiously.
double statedDrift_mm(const Dataset& dataset, double minutes) {
  const auto stated = configNumber(dataset, kDriftError.key);
  return 1e-3 * minutes * (stated && *stated ? **stated : MachineAccuracy{}.drift_um_per_min);
}

// Of half, see inputsOf: readings that tell the drift less well than it is stated change nothing.
bool tellsMore(const MatrixXd& half, double stated_mm) {
  return half.rowwise().norm().minCoeff() < stated_mm;
}

// One input for each independent combination of the drifts of the columns: covariance = half * half'.
std::vector<TypeBInput> inputsOf(const DriftDesign& design, const std::string& table, const MatrixXd& half) {
  std::vector<TypeBInput> inputs;
  for (Index k = 0; k < half.cols(); ++k) {
    const std::vector<std::string> columns{design.columns.begin(), design.columns.end()};
    const VectorXd by_one = half.col(k);
    const auto move = [columns, table, by_one](Dataset& moved, double by) {
      for (std::size_t c = 0; c < columns.size(); ++c)
        addDrift(moved, table, columns[c], by * by_one[static_cast<Index>(c)]);
    };
    inputs.push_back({.name = std::string{kDriftBudget}, .sd = 1, .move = move, .in_sd = false, .widens = true});
  }
  return inputs;
}

}  // namespace

std::optional<Explanation> explainByDrift(const Residue& before, const Method& method, const std::string& table,
                                          double least_variance) {
  constexpr std::size_t kLeastRows = 5;
  if (before.dataset.table(table)->rows() < kLeastRows) return std::nullopt;
  const auto design = driftDesign(before, method, table);
  const auto unknowns = static_cast<std::size_t>(design.changes.cols());
  const Table& readings = *before.dataset.table(table);
  const auto sigma_mm = noiseOf(before.dataset);
  const bool is_stated = sigma_mm.has_value(), is_closed = closes(readings, method, before.dataset);
  if (unknowns == 0 || before.dof < (is_closed && is_stated ? unknowns + 1 : 2 * unknowns + 2)) return std::nullopt;
  const auto fit = linearLeastSquares(design.changes, before.values());
  if (!fit) return std::nullopt;
  const VectorXd& drift = fit->parameters;  // what was in the readings
  Dataset rid = before.dataset;
  for (std::size_t k = 0; k < unknowns; ++k) addDrift(rid, table, design.columns[k], -drift[static_cast<Index>(k)]);
  auto after = residueOf(rid, method);
  if (!after || after->dof != before.dof) return std::nullopt;
  Explanation explanation{compareHypotheses(before, *after, unknowns, least_variance), *after, {}, {}, {}, {}};
  if (explanation.found.chance > kByChance && !is_closed) return std::nullopt;

  const auto dof = static_cast<double>(before.dof - unknowns);
  constexpr double kTellNoise = 4;  // spare readings that tell more than what is stated
  const double from_residuals = is_stated && dof < kTellNoise ? 0 : after->squares() / std::max(dof - 2, 1.0);
  const double stated = is_stated ? *sigma_mm * *sigma_mm : 0;
  const MatrixXd half = lowerCholesky(fit->cofactor * std::max(from_residuals, stated));
  explanation.drift = inputsOf(design, table, half);
  const auto minutes = minutesOf(readings, before.dataset);
  if (explanation.found.chance > kByChance && !tellsMore(half, statedDrift_mm(before.dataset, minutes.value_or(0))))
    return std::nullopt;
  const bool is_likely = explanation.found.chance <= kByChance;
  for (std::size_t k = 0; k < unknowns; ++k) {
    const auto at = static_cast<Index>(k);
    const double sd = half.row(at).norm();
    if (minutes) explanation.rates.push_back(rateOf(design.columns[k], drift[at] / *minutes, sd / *minutes));
    if (!is_likely || std::abs(drift[at]) < 3 * sd) continue;
    explanation.drifts += (explanation.drifts.empty() ? "" : ", ") + std::string{design.columns[k]} + " by " +
                          text(std::round(drift[at] * 1e4) / 10) + " um";
  }
  return explanation;
}

}  // namespace probebox::metrology
