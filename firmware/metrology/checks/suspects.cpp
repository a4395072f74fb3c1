#include "firmware/metrology/checks/suspects.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include "firmware/metrology/checks/drift.hpp"
#include "firmware/metrology/checks/likely_causes.hpp"
#include "firmware/metrology/checks/residue.hpp"
#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/uncertainty/budget.hpp"

namespace probebox::metrology {
namespace {

// Factor by which a wrong sign or unit has to multiply the squares of the residuals, beside the test.
constexpr double kWrongByFar = 25;
constexpr std::string_view kAngleReversed = "angle-reversed";
constexpr double kMoreThanStated = 1.5;  // scatter by the stated sigma
constexpr std::size_t kCandidates = 5;   // readings with the largest residuals: leverage hides the worst a little

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
    Transform reversed{std::string{kAngleReversed},
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

// All lengths in inches leave the same residuals but for their unit; stamped motion tells them from its speed.
Transform inMillimetres(const Dataset& dataset, const Method& method) {
  constexpr double kInch_mm = 25.4;
  Transform scaled{std::string{kLengthsInInches},
                   "the machine moves at the stated speeds where every coordinate is taken for inches; convert the "
                   "coordinates to mm",
                   dataset};
  scaleColumns(
      scaled.dataset, method, [](const MethodColumn& each) { return isCoordinate(each.role); }, kInch_mm);
  return scaled;
}

bool isOfStreams(const Dataset& dataset, const Method& method) {
  return std::ranges::any_of(method.tables, [&](const MethodTable& described) {
    const auto* table = dataset.table(described.name);
    return table != nullptr && table->column(column::kTime) != nullptr;
  });
}

// Streams in another unit contradict the stated speeds: the refusal of those that are solved, with fewer warnings than
// `before`, in another one.
std::optional<Refusal> otherUnitOfStreams(const Dataset& dataset, const Method& method, const Result* before) {
  if (!isOfStreams(dataset, method) || (before != nullptr && before->warnings.empty())) return std::nullopt;
  if (before == nullptr && method.solver(dataset)) return std::nullopt;  // its uncertainty is what is refused
  auto transforms = transformsOf(dataset, method);
  transforms.push_back(inMillimetres(dataset, method));
  for (auto& [name, reason, transformed] : transforms) {
    // A screw turns either way; joints have no coordinates.
    if (name == kAngleReversed || transformed == dataset) continue;
    const auto after = method.solver(transformed);
    if (after && (before == nullptr || after->warnings.size() < before->warnings.size())) return Refusal{name, reason};
  }
  return std::nullopt;
}

std::optional<Refusal> refuseTransformed(const Residue& first, const Method& method) {
  const double least = leastVarianceOf(first);
  std::optional<Refusal> likeliest;
  double best = 0;
  for (auto& [name, reason, dataset] : transformsOf(first.dataset, method)) {
    const auto after = residueOf(dataset, method);
    if (!after || after->dof != first.dof) continue;
    // The unit or the sign is one unknown, at the best value of which the squares are as few or fewer.
    const auto found = compareByStatedNoise(first, *after, 1, least);
    const double left = std::max(after->squares(), least * static_cast<double>(first.dof));
    if (found.chance > kByChance * 10 || first.squares() < kWrongByFar * left || found.score <= best) continue;
    best = found.score;
    likeliest = Refusal{name, reason};
  }
  return likeliest;
}

// ---- A reading that is off

Dataset without(Dataset dataset, const ReadingRow& left_out) {
  for (auto& table : dataset.tables) {
    if (table.name != left_out.table) continue;
    for (auto& column : table.columns)
      column.values.erase(column.values.begin() + static_cast<std::ptrdiff_t>(left_out.row));
  }
  return dataset;
}

// Rows of the largest residuals, the largest first.
std::vector<ReadingRow> farthestRows(const Residue& residue) {
  std::map<ReadingRow, double> squares;
  for (std::size_t k = 0; k < residue.residuals.names.size(); ++k) {
    if (const auto row = readingRowOf(residue.dataset, residue.residuals.names[k]))
      squares[*row] += residue.residuals.values[k] * residue.residuals.values[k];
  }
  std::vector<ReadingRow> rows;
  for (const auto& [row, square] : squares) rows.push_back(row);
  std::ranges::stable_sort(rows, std::ranges::greater{}, [&](const ReadingRow& row) { return squares[row]; });
  rows.resize(std::min(rows.size(), kCandidates));
  return rows;
}

std::size_t readingsOf(const Residue& residue) {
  std::size_t readings = 0;
  for (const auto& table : readingTablesOf(residue)) readings += residue.dataset.table(table)->rows();
  return readings;
}

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
    ReadingRow best_row;
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
    so_far.found = compareByStatedNoise(with, so_far.after, with.dof - so_far.after.dof, least);
    if (so_far.found.chance * choices >= kByChance) continue;
    found = so_far;
    found->found = compareByStatedNoise(before, so_far.after, before.dof - so_far.after.dof, least);
    choices = 1;
    tried = 0;
  }
  return found;
}

// ---- All together

// Number of a row in the file, from 0, of which those of `gone`, ascending, are not in the table any more.
std::size_t numberInFile(std::size_t row, const std::set<std::size_t>& gone) {
  for (const auto earlier : gone) row += earlier <= row ? 1 : 0;
  return row;
}

std::size_t coordinatesOf(const Residue& residue) {
  std::size_t coordinates = 0;
  for (const auto& table : readingTablesOf(residue)) {
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

void numberAsInFile(Residuals& residuals, const Mended& mended) {
  for (auto& name : residuals.names) {
    const auto row = readingRowOf(mended.dataset, name);
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

// before: of the dataset, or of it without what refuses it.
Outcome<Mended, Refusal> mendReadings(const Dataset& dataset, const Method& method, std::optional<Residue> before) {
  Mended mended{dataset, {}, {}, {}, {}, {}};
  if (!before || before->dof < 2 || isOfStreams(dataset, method)) return mended;
  before->dataset = dataset;
  if (auto refusal = refuseTransformed(*before, method)) return *refusal;
  const double least = leastVarianceOf(*before);
  for (bool drifts = false;;) {
    auto best = mended.left_out.empty() ? explainByRows(*before, method, least) : std::nullopt;
    for (const auto& table : drifts ? std::set<std::string>{} : readingTablesOf(*before)) {
      auto drift = explainByDrift(*before, method, table, least);
      if (drift && (!best || drift->found.score > best->found.score)) best = std::move(drift);
    }
    if (!best) return mended;
    drifts = drifts || best->left_out.empty();
    before = best->after;
    apply(*std::move(best), mended);
  }
}

// Without which readings, or drift, a refused case is solved, as a part of a sentence; empty of none. The stated noise
// tells a gross fault where few readings are left.
Outcome<std::string, Refusal> mendOnce(const Dataset& dataset, Dataset unweighted, const Method& method,
                                       const std::optional<Residue>& before) {
  for (const Dataset& by : {std::move(unweighted), dataset}) {
    TRY(auto mended, mendReadings(by, method, before));
    if (!mended.changed()) continue;
    for (const auto& [key, value] : dataset.config) mended.dataset.config.try_emplace(key, value);
    if (!method.solver(mended.dataset)) continue;
    std::string rows;
    for (const auto& dropped : mended.dropped) rows += (rows.empty() ? "" : ", ") + dropped.name;
    if (rows.empty()) return std::string{"; without a drift of the readings in their order it is solved"};
    return "; without " + rows + " it is solved: look for a slip, dirt or a mistyped digit there, and read it again";
  }
  return std::string{};
}

}  // namespace

Outcome<Mended, Refusal> mendFaults(const Dataset& dataset, const Method& method, const Result& first) {
  if (auto refusal = otherUnitOfStreams(dataset, method, &first)) return *refusal;
  return mendReadings(dataset, method, residueOf(dataset, method));
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

void nameOtherUnits(const Dataset& dataset, const Method& method, Result& result) {
  constexpr double kLess = 1.0 / 3;  // of the rms
  const auto isOfResiduals = [](const std::string& warning) {
    constexpr std::array kNames{kResidualsExceedNoise, kResidualsShowAPattern, kReadingsContradict};
    return std::ranges::any_of(kNames, [&](auto name) { return warning.starts_with(name); });
  };
  const auto warning = std::ranges::find_if(result.warnings, isOfResiduals);
  if (warning == result.warnings.end()) return;
  for (const auto& [name, reason, transformed] : transformsOf(dataset, method)) {
    const auto after = method.solver(transformed);
    if (!after || after->rms > kLess * result.rms || std::ranges::any_of(after->warnings, isOfResiduals)) continue;
    *warning += "; " + name + ": " + reason;
  }
}

Refusal withLikelyCause(const Dataset& dataset, const Method& method, Refusal refusal) {
  // Along one axis a wrong unit is not told from a wrong speed or clock.
  if (const auto unit = otherUnitOfStreams(dataset, method, nullptr)) refusal.reason += "; or " + unit->reason;
  if (!isOfStreams(dataset, method) && !method.solver(dataset) && method.solver(inMillimetres(dataset, method).dataset))
    refusal.reason += "; with the coordinates taken for inches it is solved: are they?";
  constexpr std::array<std::string_view, 3> kOfResiduals{"residual-too-large", kReadingsContradict, "steps-disagree"};
  if (std::ranges::find(kOfResiduals, refusal.name) == kOfResiduals.end()) return refusal;
  // A sigma that nobody states refuses nothing, and shows by how much the residuals fall.
  Dataset unweighted = dataset;
  unweighted.config.erase(std::string{key::kSigma.name});
  const auto before = residueOf(unweighted, method);
  const auto mended = mendOnce(dataset, unweighted, method, before);
  if (!mended) return mended.error();
  refusal.reason += *mended;
  for (auto& [name, reason, transformed] : transformsOf(dataset, method)) {
    const auto after = residueOf(transformed, method);
    if (after && before ? after->dof > 1 && before->squares() >= kWrongByFar * after->squares()
                        : method.solver(transformed).ok())
      return Refusal{name, reason};
  }
  const auto stated = configPositive(dataset, key::kSigma.name);
  const double sigma_mm = stated && *stated ? **stated : 0;
  if (const auto causes = likelyCauses(dataset, method, sigma_mm)) refusal.reason += "; " + *causes;
  if (!before || !(sigma_mm > 0)) return refusal;
  const double scatter_mm = std::sqrt(before->squares() / static_cast<double>(before->dof));
  if (scatter_mm > kMoreThanStated * sigma_mm)
    refusal.reason += "; the readings scatter by " + text(scatter_mm) +
                      " mm about the fit, more than the stated sigma of " + text(sigma_mm) +
                      " mm: look for vibration, or state the sigma that they have";
  return refusal;
}

}  // namespace probebox::metrology
