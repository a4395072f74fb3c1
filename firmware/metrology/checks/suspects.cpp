#include "firmware/metrology/checks/suspects.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/digits.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/read_times.hpp"
#include "firmware/metrology/fit/chi_square.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/uncertainty/budget.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Share of faultless cases that a suspicion may accuse; there are up to five of them.
constexpr double kByChance = 1e-5;
// Factor by which a wrong sign or unit has to multiply the squares of the residuals, beside the test.
constexpr double kWrongByFar = 25;
constexpr std::size_t kMostResiduals = 600;  // more are thinned, and a fit of so many takes long
constexpr std::size_t kCandidates = 5;       // readings with the largest residuals: leverage hides the worst a little
constexpr double kLeastNoise_mm = 1e-5;
struct Row {
  std::string table;
  std::size_t row{};
  friend auto operator<=>(const Row&, const Row&) = default;
};

// "readings 3, x_mm" and "point 3" name the third row of tables readings and points; other names no row.
std::optional<Row> rowOf(const Dataset& dataset, std::string_view name) {
  name = name.substr(0, name.find(','));
  const auto space = name.rfind(' ');
  if (space == std::string_view::npos) return std::nullopt;
  std::size_t number = 0;
  const auto digits = name.substr(space + 1);
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), number);
  if (error != std::errc{} || end != digits.data() + digits.size() || number == 0) return std::nullopt;
  for (const auto& suffix : {"", "s"}) {
    const std::string table = std::string{name.substr(0, space)} + suffix;
    const Table* found = dataset.table(table);
    if (found != nullptr && number <= found->rows()) return Row{table, number - 1};
  }
  return std::nullopt;
}

// Residuals of a case, as one of the hypotheses has them.
struct Residue {
  Dataset dataset;
  const Method* method{};
  Residuals residuals;
  std::size_t dof{};

  VectorXd values() const { return VectorXd::Map(residuals.values.data(), std::ssize(residuals.values)); }
  double squares() const { return values().squaredNorm(); }
  bool isCoordinate(std::string_view table, std::string_view column) const {
    return metrology::isCoordinate(columnOf(*method, table, column).role);
  }
};

// Residuals of the readings in mm with degrees of freedom; nothing where there is no such thing to look at, or where
// they are not those that the fit has made least.
std::optional<Residue> residueOf(const Dataset& dataset, const Method& method) {
  auto solved = method.solver(dataset);
  if (!solved || solved->dof == 0 || solved->residuals.unit != "mm") return std::nullopt;
  const auto size = solved->residuals.values.size();
  if (size < solved->dof || size > kMostResiduals || solved->residuals.names.size() != size) return std::nullopt;
  const double rms = solved->rms;
  Residue residue{dataset, &method, std::move(solved->residuals), solved->dof};
  const double told = std::sqrt(residue.squares() / static_cast<double>(size));
  return std::abs(told - rms) <= 0.01 * rms + kLeastNoise_mm / 10 ? std::optional{std::move(residue)} : std::nullopt;
}

std::vector<double>* valuesOf(Dataset& dataset, std::string_view table, std::string_view column) {
  const auto found = std::ranges::find(dataset.tables, table, &Table::name);
  if (found == dataset.tables.end()) return nullptr;
  const auto values = std::ranges::find(found->columns, column, &Column::name);
  return values == found->columns.end() ? nullptr : &values->values;
}

// Tables whose rows are readings of the fit: those that residuals name, and those whose times are stated.
std::set<std::string> tablesOf(const Residue& residue) {
  std::set<std::string> tables;
  for (const auto& described : residue.method->tables) {
    const Table* table = described.readings ? residue.dataset.table(described.name) : nullptr;
    if (table != nullptr && table->column(column::kReadAt) != nullptr) tables.insert(table->name);
  }
  for (const auto& name : residue.residuals.names) {
    if (const auto row = rowOf(residue.dataset, name)) tables.insert(row->table);
  }
  return tables;
}

// "x_mm" of "readings 3, x_mm"; empty of a point.
std::string_view partOf(std::string_view name) {
  const auto comma = name.rfind(", ");
  return comma == std::string_view::npos ? std::string_view{} : name.substr(comma + 2);
}

// Residuals of one coordinate.
using ByPart = std::map<std::string_view, std::vector<double>>;

ByPart byPart(const Residue& residue) {
  ByPart parts;
  for (std::size_t k = 0; k < residue.residuals.names.size(); ++k)
    parts[partOf(residue.residuals.names[k])].push_back(residue.residuals.values[k]);
  return parts;
}

// Variance below which residuals say nothing: rounding, and half of what is stated. Columns of set or of equal values
// tell no digits.
double leastVariance(const Residue& residue) {
  const auto parts = byPart(residue);
  const bool has_parts =
      std::ranges::any_of(parts, [&](const auto& part) { return residue.isCoordinate({}, part.first); });
  double digit_mm = 0;
  for (const auto& table : residue.dataset.tables) {
    for (const auto& column : table.columns) {
      if (!residue.isCoordinate(table.name, column.name) || (has_parts && !parts.contains(column.name))) continue;
      const auto shown = shownDigit(column.values, 1);
      if (!shown.constant) digit_mm = std::max(digit_mm, shown.digit);
    }
  }
  const auto sigma = configPositive(residue.dataset, key::kSigma.name);
  const double half_mm = sigma && *sigma ? **sigma / 2 : 0;
  return std::max({kLeastNoise_mm * kLeastNoise_mm, digit_mm * digit_mm / 12, half_mm * half_mm});
}

// How two hypotheses compare. score: of several suspicions the one with the greatest explains best.
struct Comparison {
  double chance{1};
  double score{};
};

// By an F test. Coordinates may scatter differently: each is measured by what is left of it, of which the fewer degrees
// of freedom count.
Comparison compare(const Residue& before, const Residue& after, std::size_t unknowns, double least_variance) {
  if (unknowns == 0 || before.dof <= unknowns) return {};
  const auto was = byPart(before), is = byPart(after);
  const auto dof = static_cast<double>(before.dof - unknowns);
  const auto squaresOf = [](const std::vector<double>& values) {
    return VectorXd::Map(values.data(), std::ssize(values)).squaredNorm();
  };
  double less = 0;
  std::size_t parts = 0;
  for (const auto& [part, values] : was) {
    const auto left = is.find(part);
    const double squares = left == is.end() ? 0 : squaresOf(left->second);
    const double share = static_cast<double>(values.size()) / static_cast<double>(before.residuals.values.size());
    less += (squaresOf(values) - squares) / std::max(squares / (share * dof), least_variance);
    parts += 1;
  }
  if (!(less > 0)) return {};
  const ChiSquareLaw law{unknowns, std::max<std::size_t>(1, (before.dof - unknowns) / parts)};
  return {law.probabilityAbove(less / static_cast<double>(unknowns)), dof * std::log1p(less / dof)};
}

// ---- X in diameters, an angle reversed

struct Transform {
  std::string name;    // of the refusal
  std::string reason;  // what is so, and the remedy
  Dataset dataset;
};

// Not a certificate, nor places that are chosen. The first table of a method holds its readings.
bool holdsReadings(const Method& method, const Table& table) {
  const auto described = std::ranges::find(method.tables, table.name, &MethodTable::name);
  return described != method.tables.end() && (described->readings || described == method.tables.begin());
}

// Multiplies the columns whose description `which` picks.
template <class Which>
void scaleColumns(Dataset& dataset, const Method& method, const Which& which, double factor) {
  for (auto& table : dataset.tables) {
    if (!holdsReadings(method, table)) continue;
    for (auto& [name, values] : table.columns) {
      if (!which(columnOf(method, table.name, name))) continue;
      for (double& value : values) value *= factor;
    }
  }
}

std::vector<Transform> transformsOf(const Dataset& dataset, const Method& method) {
  std::vector<Transform> transforms;
  Transform halved{"x-in-diameters",
                   "the readings contradict each other, and agree where every X is halved: X was written in "
                   "diameters; give x_mm in radius, as the machine's axis moves",
                   dataset};
  const auto isX = [](const MethodColumn& each) {
    return isCoordinate(each.role) && each.name.ends_with(column::kX.name);
  };
  scaleColumns(halved.dataset, method, isX, 0.5);
  if (halved.dataset != dataset) transforms.push_back(std::move(halved));
  std::set<std::string> angles;
  for (const auto& table : dataset.tables) {
    if (!holdsReadings(method, table)) continue;
    for (const auto& column : table.columns) {
      if (isInDegrees(column.name) || isInRadians(column.name)) angles.insert(column.name);
    }
  }
  for (const auto& angle : angles) {
    const std::string sense = angle.substr(0, 1) + "_sense";
    const bool takes_sense = std::ranges::find(method.keys, sense, &MethodKey::name) != method.keys.end();
    Transform reversed{"angle-reversed",
                       "the readings contradict each other, and agree where " + angle +
                           " is reversed: the axis counts the other way than ISO 841 has it; change the sign of " +
                           angle + (takes_sense ? ", or state " + sense : ""),
                       dataset};
    scaleColumns(
        reversed.dataset, method, [&](const MethodColumn& each) { return each.name == angle; }, -1);
    transforms.push_back(std::move(reversed));
  }
  return transforms;
}

std::optional<Refusal> refuseTransformed(const Residue& first, const Method& method) {
  const double least = leastVariance(first);
  std::optional<Refusal> likeliest;
  double best = 0;
  for (auto& [name, reason, dataset] : transformsOf(first.dataset, method)) {
    const auto after = residueOf(dataset, method);
    if (!after || after->dof != first.dof) continue;
    // The unit or the sign is one unknown, at the best value of which the squares are as few or fewer.
    const auto found = compare(first, *after, 1, least);
    const double left = std::max(after->squares(), least * static_cast<double>(first.dof));
    if (found.chance > kByChance * 10 || first.squares() < kWrongByFar * left || found.score <= best) continue;
    best = found.score;
    likeliest = Refusal{name, reason};
  }
  return likeliest;
}

// ---- A reading that is off

Dataset without(Dataset dataset, const Row& left_out) {
  for (auto& table : dataset.tables) {
    if (table.name != left_out.table) continue;
    for (auto& column : table.columns)
      column.values.erase(column.values.begin() + static_cast<std::ptrdiff_t>(left_out.row));
  }
  return dataset;
}

// Rows of the largest residuals, the largest first.
std::vector<Row> farthestRows(const Residue& residue) {
  std::map<Row, double> squares;
  for (std::size_t k = 0; k < residue.residuals.names.size(); ++k) {
    if (const auto row = rowOf(residue.dataset, residue.residuals.names[k]))
      squares[*row] += residue.residuals.values[k] * residue.residuals.values[k];
  }
  std::vector<Row> rows;
  for (const auto& [row, square] : squares) rows.push_back(row);
  std::ranges::stable_sort(rows, std::ranges::greater{}, [&](const Row& row) { return squares[row]; });
  rows.resize(std::min(rows.size(), kCandidates));
  return rows;
}

std::size_t readingsOf(const Residue& residue) {
  std::size_t readings = 0;
  for (const auto& table : tablesOf(residue)) readings += residue.dataset.table(table)->rows();
  return readings;
}

// An explanation of the residuals, and the case without what it names.
struct Explanation {
  Comparison found;
  Residue after;
  std::vector<Row> left_out;  // one after the other: rows of what was left before
  std::vector<TypeBInput> drift;
  std::vector<Estimate> rates;
  std::string drifts;  // "x_mm by 20 um"
};

// Up to three readings, each the one without which least is left. Few and a tenth of all at most are called off: of
// more, nobody knows which are. Two that hide each other are found together.
std::optional<Explanation> explainByRows(const Residue& before, const Method& method, double least) {
  const std::size_t readings = readingsOf(before);
  const std::size_t most = std::min<std::size_t>(3, std::max<std::size_t>(1, readings / 10));
  Explanation so_far{{}, before, {}, {}, {}, {}};
  std::optional<Explanation> found;
  double choices = 1;  // of the rows since the last that were found
  for (std::size_t k = 0, tried = 1; k < most; ++k, ++tried) {
    std::optional<Residue> best;
    Row best_row;
    for (const auto& row : farthestRows(so_far.after)) {
      auto after = residueOf(without(so_far.after.dataset, row), method);
      if (!after || after->dof >= so_far.after.dof || (best && after->squares() >= best->squares())) continue;
      best = std::move(after);
      best_row = row;
    }
    if (!best) break;
    so_far.left_out.push_back(best_row);
    so_far.after = *std::move(best);
    choices *= static_cast<double>(readings - k) / static_cast<double>(tried);
    const auto& with = found ? found->after : before;
    so_far.found = compare(with, so_far.after, with.dof - so_far.after.dof, least);
    if (so_far.found.chance * choices >= kByChance) continue;
    found = so_far;
    found->found = compare(before, so_far.after, before.dof - so_far.after.dof, least);
    choices = 1;
    tried = 0;
  }
  return found;
}

// ---- Drift

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
  auto& values = *valuesOf(dataset, table, column);
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

std::optional<Explanation> explainByDrift(const Residue& before, const Method& method, const std::string& table,
                                          double least) {
  constexpr std::size_t kLeastRows = 5;
  if (before.dataset.table(table)->rows() < kLeastRows) return std::nullopt;
  const auto design = driftDesign(before, method, table);
  const auto unknowns = static_cast<std::size_t>(design.changes.cols());
  const Table& readings = *before.dataset.table(table);
  const auto sigma = configPositive(before.dataset, key::kSigma.name);
  const bool is_stated = sigma && *sigma, is_closed = closes(readings, method, before.dataset);
  if (unknowns == 0 || before.dof < (is_closed && is_stated ? unknowns + 4 : 2 * unknowns + 2)) return std::nullopt;
  const auto fit = linearLeastSquares(design.changes, before.values());
  if (!fit) return std::nullopt;
  const VectorXd& drift = fit->parameters;  // what was in the readings
  Dataset rid = before.dataset;
  for (std::size_t k = 0; k < unknowns; ++k) addDrift(rid, table, design.columns[k], -drift[static_cast<Index>(k)]);
  auto after = residueOf(rid, method);
  if (!after || after->dof != before.dof) return std::nullopt;
  Explanation explanation{compare(before, *after, unknowns, least), *after, {}, {}, {}, {}};
  if (explanation.found.chance > kByChance && !is_closed) return std::nullopt;

  const auto dof = static_cast<double>(before.dof - unknowns);
  const double from_residuals = after->squares() / std::max(dof - 2, 1.0);
  const double stated = is_stated ? **sigma * **sigma : 0;
  const MatrixXd half = lowerCholesky(fit->cofactor * std::max(from_residuals, stated));
  explanation.drift = inputsOf(design, table, half);
  const auto minutes = minutesOf(readings, before.dataset);
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

// ---- All together

// Number of a row in the file, from 0, of which those of `gone`, ascending, are not in the table any more.
std::size_t numberInFile(std::size_t row, const std::set<std::size_t>& gone) {
  for (const auto earlier : gone) row += earlier <= row ? 1 : 0;
  return row;
}

std::size_t coordinatesOf(const Residue& residue) {
  std::size_t coordinates = 0;
  for (const auto& table : tablesOf(residue)) {
    for (const auto& column : residue.dataset.table(table)->columns)
      if (residue.isCoordinate(table, column.name)) ++coordinates;
  }
  return coordinates;
}

void apply(Explanation explanation, Mended& mended) {
  const std::size_t coordinates = coordinatesOf(explanation.after);
  std::string rows;
  for (const auto& [table, row] : explanation.left_out) {
    auto& gone = mended.left_out[table];
    const auto number = numberInFile(row, gone);
    gone.insert(number);
    const auto name = table + " " + std::to_string(number + 1);
    mended.dropped.push_back({name, "does not belong to the others by an F test on the residuals"});
    rows += (rows.empty() ? "" : ", ") + name;
  }
  if (!rows.empty()) {
    mended.warnings.push_back(std::string{kReadingLeftOut} + ": " + rows +
                              " of the case: the other readings agree with each other and not with it; it is left out "
                              "of the answer; look for a slip, dirt or a mistyped digit, and read it again");
  } else if (!explanation.drifts.empty()) {
    mended.warnings.push_back(
        std::string{kReadingsDrift} + ": the readings drift in their order: from the first to the last " +
        explanation.drifts +
        "; the drift is taken out, its uncertainty is in the sd, and the values are those of the middle of the "
        "readings; let the machine warm up, look for what is loose, and read again");
  }
  mended.drift.insert(mended.drift.end(), explanation.drift.begin(), explanation.drift.end());
  mended.rates.insert(mended.rates.end(), explanation.rates.begin(), explanation.rates.end());
  mended.dataset = std::move(explanation.after.dataset);
  // What the readings themselves show of all coordinates takes the place of what is stated. Of one whose drift the
  // unknowns hide, nothing is shown.
  if (!mended.drift.empty() && mended.drift.size() >= coordinates) mended.dataset.config[kDriftError.key] = 0.0;
}

Dataset asSolved(const Dataset& dataset, const Method& method) {
  return dataset.config.contains("expansion_per_k") ? atTemperature(dataset, method) : dataset;
}

void numberAsInFile(Residuals& residuals, const Mended& mended) {
  for (auto& name : residuals.names) {
    const auto row = rowOf(mended.dataset, name);
    const auto gone = row ? mended.left_out.find(row->table) : mended.left_out.end();
    if (gone == mended.left_out.end()) continue;
    const auto number = std::to_string(numberInFile(row->row, gone->second) + 1);
    const auto end = std::min(name.find(','), name.size()), begin = name.rfind(' ', end - 1) + 1;
    name.replace(begin, end - begin, number);
  }
}

// A drift takes as many degrees of freedom as it has unknowns from a sigma that only the residuals tell.
void takeDegrees(Result& result, std::size_t unknowns) {
  constexpr double kOfStudent = 2;
  const auto before = static_cast<double>(result.dof);
  result.dof -= std::min(result.dof, unknowns);
  const auto after = static_cast<double>(result.dof);
  if (result.chi2_reduced || result.budget.empty() || after <= kOfStudent) return;
  const double factor = std::sqrt((before - kOfStudent) / (after - kOfStudent));
  auto& readings = result.budget.front().sd;
  std::size_t at = 0;
  for (auto& estimate : result.estimates) {
    for (std::size_t k = 0; k < estimate.values.size(); ++k, ++at) {
      const double more = readings[at] * std::sqrt(factor * factor - 1);
      readings[at] *= factor;
      if (k < estimate.sd.size()) estimate.sd[k] = std::hypot(estimate.sd[k], more);
      if (k < estimate.uncertainty.size()) estimate.uncertainty[k] = std::hypot(estimate.uncertainty[k], more);
    }
  }
  if (!result.covariance) return;
  for (double& value : result.covariance->values) value *= factor * factor;
}

// ---- Lengths that no machine has

std::optional<std::string> unusual(const std::string& what, double size_mm, const UsualSize& usual) {
  if (size_mm >= usual.least_mm && size_mm <= usual.most_mm) return std::nullopt;
  const bool small = size_mm < usual.least_mm;
  return std::string{kUnusualLength} + ": " + what + " " + text(std::round(size_mm * 1000) / 1000) + " mm, " +
         (small ? "less than " + text(usual.least_mm) : "more than " + text(usual.most_mm)) +
         " mm, as seldom on a machine tool: are the lengths of this case in " +
         (small ? "inches? They are taken for mm" : "micrometres? They are taken for mm");
}

// Longest way of the readings along a machine axis.
double wayOf_mm(const Dataset& dataset, const Method& method, const Result& result) {
  const Residue residue{dataset, &method, result.residuals, result.dof};
  double way_mm = 0;
  for (const auto& table : tablesOf(residue)) {
    for (const auto& column : dataset.table(table)->columns) {
      if (!residue.isCoordinate(table, column.name)) continue;
      const auto [least, most] = std::ranges::minmax(column.values);
      way_mm = std::max(way_mm, most - least);
    }
  }
  return way_mm;
}

std::optional<std::string> unusualLength(const Dataset& dataset, const Method& method, const Result& result,
                                         const Estimate& estimate) {
  const auto* quantity = quantityOf(method, estimate.key);
  if (quantity == nullptr || quantity->usual.most_mm == 0 || estimate.values.empty()) return std::nullopt;
  const auto& usual = quantity->usual;
  if (usual.of_readings)
    return unusual("the places that were read are apart by", wayOf_mm(dataset, method, result), usual);
  const auto size = [](double value) { return std::abs(value); };
  return unusual(estimate.key + " is up to", size(std::ranges::max(estimate.values, {}, size)), usual);
}

}  // namespace

Outcome<Mended, Refusal> mendFaults(const Dataset& dataset, const Method& method, const Result& first) {
  Mended mended{dataset, {}, {}, {}, {}, {}};
  const auto is_stream = [&](const MethodTable& described) {
    const auto* table = dataset.table(described.name);
    return table != nullptr && table->column(column::kTime) != nullptr;
  };
  if (first.dof < 2 || first.residuals.unit != "mm" || std::ranges::any_of(method.tables, is_stream)) return mended;
  auto before = residueOf(asSolved(dataset, method), method);
  if (!before) return mended;
  if (auto refusal = refuseTransformed(*before, method)) return *refusal;
  const double least = leastVariance(*before);
  for (bool drifts = false;;) {
    auto best = mended.left_out.empty() ? explainByRows(*before, method, least) : std::nullopt;
    for (const auto& table : drifts ? std::set<std::string>{} : tablesOf(*before)) {
      auto drift = explainByDrift(*before, method, table, least);
      if (drift && (!best || drift->found.score > best->found.score)) best = std::move(drift);
    }
    if (!best) return mended;
    drifts = drifts || best->left_out.empty();
    before = best->after;
    apply(*std::move(best), mended);
  }
}

Solved solveMended(const Mended& mended, const Method& method, StoreReader store) {
  auto solved = withUncertainty(mended.dataset, method, store, mended.drift);
  if (!solved) return solved;
  takeDegrees(solved.value(), mended.drift.size());
  numberAsInFile(solved->residuals, mended);
  solved->dropped.insert(solved->dropped.end(), mended.dropped.begin(), mended.dropped.end());
  solved->also.insert(solved->also.end(), mended.rates.begin(), mended.rates.end());
  solved->warnings.insert(solved->warnings.begin(), mended.warnings.begin(), mended.warnings.end());
  return solved;
}

Refusal withLikelyCause(const Dataset& dataset, const Method& method, Refusal refusal) {
  constexpr std::array<std::string_view, 2> kOfResiduals{"residual-too-large", "readings-contradict"};
  if (std::ranges::find(kOfResiduals, refusal.name) == kOfResiduals.end()) return refusal;
  // A sigma that nobody states refuses nothing, and shows by how much the residuals fall.
  Dataset unweighted = asSolved(dataset, method);
  unweighted.config.erase(std::string{key::kSigma.name});
  const auto before = residueOf(unweighted, method);
  for (auto& [name, reason, transformed] : transformsOf(dataset, method)) {
    const auto after = residueOf(asSolved(transformed, method), method);
    if (!after || after->dof <= 1) continue;
    if (!before || before->squares() >= kWrongByFar * after->squares()) return {name, reason};
  }
  return refusal;
}

std::optional<Refusal> warnOfNoRedundancy(const Dataset&, const Method&, Result& result) {
  if (result.dof == 0 && !result.residuals.values.empty()) {
    result.warnings.push_back(std::string{kNoRedundancy} +
                              ": there are as many readings as unknowns, so that none checks another: a slip in one "
                              "of them is in the answer and in no sd; read once more than needed");
  }
  return std::nullopt;
}

std::optional<Refusal> warnOfUnusualScatter(const Dataset& dataset, const Method&, Result& result) {
  constexpr double kUsual_mm = 0.02;  // a worn machine and a rough ball scatter less
  const auto& values = result.residuals.values;
  if (dataset.config.contains(key::kSigma.name) || result.residuals.unit != "mm" || result.dof == 0)
    return std::nullopt;
  // rms is of all residuals that were not dropped, of which `values` may be some.
  const auto count = static_cast<double>(std::max(values.size(), result.dof));
  const double sd_mm = result.rms * std::sqrt(count / static_cast<double>(result.dof));
  if (!(sd_mm > kUsual_mm)) return std::nullopt;
  const auto farthest = std::ranges::max_element(values, {}, [](double value) { return std::abs(value); });
  result.warnings.push_back(std::string{kUnusualScatter} + ": the readings scatter by " +
                            text(std::round(sd_mm * 1e3) / 1e3) + " mm (k = 1) about the answer, more than " +
                            text(kUsual_mm) + " mm, as seldom on a machine tool; the farthest is " +
                            result.residuals.names[static_cast<std::size_t>(farthest - values.begin())] +
                            ": look for a mistyped digit, a slip, a loose part, or X in diameters");
  return std::nullopt;
}

std::optional<Refusal> warnOfUnusualLengths(const Dataset& dataset, const Method& method, Result& result) {
  for (const auto& estimate : result.estimates) {
    if (auto sentence = unusualLength(dataset, method, result, estimate))
      result.warnings.push_back(*std::move(sentence));
  }
  return std::nullopt;
}

}  // namespace probebox::metrology
