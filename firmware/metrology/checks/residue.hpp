#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <iterator>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/uncertainty/known_quantities.hpp"

// What a fit leaves of the readings of a case, and how well a suspicion explains it.
namespace probebox::metrology {

// Share of faultless cases that a suspicion may accuse; there are up to five of them.
inline constexpr double kByChance = 1e-5;

struct ReadingRow {
  std::string table;
  std::size_t row{};
  friend auto operator<=>(const ReadingRow&, const ReadingRow&) = default;
};

// "readings 3, x_mm" and "point 3" name the third row of tables readings and points; other names no row.
std::optional<ReadingRow> readingRowOf(const Dataset& dataset, std::string_view name);

// Residuals of a case, as one of the hypotheses has them.
struct Residue {
  Dataset dataset;
  const Method* method{};
  Residuals residuals;
  std::size_t dof{};

  Eigen::VectorXd values() const { return Eigen::VectorXd::Map(residuals.values.data(), std::ssize(residuals.values)); }
  double squares() const { return values().squaredNorm(); }
  bool isCoordinate(std::string_view table, std::string_view column) const {
    return metrology::isCoordinate(columnOf(*method, table, column).role);
  }
};

// Residuals of the readings in mm with degrees of freedom, solved at the temperature of the case; nothing where there
// is no such thing to look at, or where they are not those that the fit has made least.
std::optional<Residue> residueOf(const Dataset& dataset, const Method& method);

// Null where there is no such column.
std::vector<double>* columnValues(Dataset& dataset, std::string_view table, std::string_view column);

// Tables whose rows are readings of the fit: those that residuals name, and those whose times are stated.
std::set<std::string> readingTablesOf(const Residue& residue);

// Variance below which residuals say nothing: rounding, and half of what is stated. Columns of set or of equal values
// tell no digits.
double leastVarianceOf(const Residue& residue);

// How two hypotheses compare. score: of several suspicions the one with the greatest explains best.
struct Comparison {
  double chance{1};
  double score{};
};

// By an F test. Coordinates may scatter differently: each is measured by what is left of it, of which the fewer degrees
// of freedom count.
Comparison compareHypotheses(const Residue& before, const Residue& after, std::size_t unknowns, double least_variance);

// The stated sigma, mm, where it is all that the readings scatter by: no axis is said to stop beside its angles.
std::optional<double> noiseOf(const Dataset& dataset);

// The same, or by the stated noise, where that is what is left of squares that were a hundred times as large: with few
// readings nothing else tells a gross fault.
Comparison compareByStatedNoise(const Residue& before, const Residue& after, std::size_t unknowns,
                                double least_variance);

// An explanation of the residuals, and the case without what it names.
struct Explanation {
  Comparison found;
  Residue after;
  std::vector<ReadingRow> left_out;  // one after the other: rows of what was left before
  std::vector<TypeBInput> drift;
  std::vector<Estimate> rates;
  std::string drifts;  // "x_mm by 20 um"
};

}  // namespace probebox::metrology
