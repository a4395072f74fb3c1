#include "firmware/metrology/checks/checks.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <map>
#include <numbers>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "firmware/metrology/checks/plausible.hpp"
#include "firmware/metrology/checks/suspects.hpp"
#include "firmware/metrology/checks/unusual.hpp"
#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/digits.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"

namespace probebox::metrology {
namespace {

// A table of a case, as its method describes it.
struct TableOfCase {
  const Dataset& dataset;
  const Method& method;
  const Table& table;
  bool readings{};

  MethodColumn described(const Column& column) const { return columnOf(method, table.name, column.name); }
};

// Two turns: no method stops an axis further from its zero, and nobody who takes radians for degrees stays below.
constexpr double kFarthestStop_rad = 4 * std::numbers::pi;
constexpr double kMostDegrees = 720;
// Fifty turns, wherever on the screw they begin: a slow rotation of a screw has up to twenty, and one turn in degrees
// is more, even where angles begin anew at 360.
constexpr double kLongestRotation_rad = 100 * std::numbers::pi;
// Readings of a screw's sensor and errors of its nut exceed this; the same number of millimetres is usual.
constexpr double kLeastReading_um = 0.1;
// Least deviation of a face in um: noise alone makes a perfect face look this large. The same number in mm would be a
// usual face.
constexpr double kLeastFace_um = 0.02;
// Two hours, longer than any stream of samples; the same number of milliseconds is 7 s. Readings are taken over a day.
constexpr double kLongestStream_s = 7200, kLongestDay_s = 86400;

// Noise of the readings in columns of one role.
struct NoiseOfReadings {
  ColumnRole role;
  std::array<std::string_view, 2> keys;  // of which the first that is stated is the sd of one reading
  std::string_view unit;                 // " mm"
  double finest{};                       // the least where none is stated; 0: such readings may be equal
};
// That of a good interferometer's position, of a sensor, and of a contact (0.1 um at 100 mm).
constexpr NoiseOfReadings kNoises[]{
    {ColumnRole::coordinate, {key::kSigma.name}, " mm", 1e-4},
    {ColumnRole::sensor, {"sigma_um"}, " um", 0.1},
    {ColumnRole::contact_angle, {"sigma_contact_rad", key::kSigmaC.name}, " rad", 1e-6},
    {ColumnRole::deflection, {"sigma_sensor"}, "", 0},
};
// How improbable equal digits have to be.
constexpr double kNoChance = 1e-4;

const NoiseOfReadings* noiseOf(ColumnRole role) {
  const auto* noise = std::ranges::find(kNoises, role, &NoiseOfReadings::role);
  return noise == std::end(kNoises) ? nullptr : noise;
}

// The sd that a case states for the readings of a column.
struct StatedNoise {
  std::string key;
  std::string unit;
  double sd{};
};

std::optional<StatedNoise> statedNoise(const Dataset& dataset, const NoiseOfReadings& noise) {
  for (const auto key : noise.keys) {
    if (key.empty()) break;
    const auto stated = configPositive(dataset, key);
    if (stated && *stated) return StatedNoise{std::string{key}, std::string{noise.unit}, **stated};
  }
  return std::nullopt;
}

double digitIn(std::string_view column, double value) {
  return isInRadians(column) ? digitOfAngle(value) : digitOf(value);
}

// Probability that noise leaves a reading in the same digit as another.
double chanceOfEqual(const Dataset& dataset, const MethodColumn& column, double digit) {
  constexpr double kDensity = 0.282;  // of the difference of two readings at 0, for unit sigma: 1 / (2 sqrt(pi))
  const auto& noise = *noiseOf(column.role);
  const auto stated = statedNoise(dataset, noise);
  return std::min(1.0, kDensity * digit / (stated ? stated->sd : noise.finest));
}

// True of columns with noisy readings; others hold set or chosen values.
bool isMeasured(const MethodColumn& column) {
  const auto* noise = noiseOf(column.role);
  return noise != nullptr && noise->finest > 0;
}

// The same pose a whole turn later has the same angle here.
double withinATurn(double angle, double turn) {
  constexpr double kSame = 1e-7;   // of an angle
  constexpr double kBeside = 0.1;  // no pose is where the remainder changes its sign
  return std::round(std::remainder(angle + kBeside, turn) / kSame);
}

std::vector<double> rowOf(const TableOfCase& of, std::size_t row) {
  std::vector<double> values;
  for (const auto& column : of.table.columns) {
    double value = column.values[row];
    if (isInDegrees(column.name)) value = withinATurn(value, 360);
    if (isInRadians(column.name) && !isMeasured(of.described(column))) value = withinATurn(value, 2 * std::numbers::pi);
    values.push_back(value);
  }
  return values;
}

// A single reading with few digits may equal another by chance, and so may angles, whose display is often coarse.
bool tellsCopies(const TableOfCase& of, std::size_t row) {
  double chance = 1;
  std::size_t measured = 0;
  bool angles = false, stamped = false;
  for (const auto& column : of.table.columns) {
    const auto described = of.described(column);
    stamped = stamped || described.role == ColumnRole::stamp;
    if (!isMeasured(described)) continue;
    ++measured;
    angles = angles || isInRadians(column.name);
    chance *= chanceOfEqual(of.dataset, described, digitIn(column.name, column.values[row]));
  }
  constexpr double kRare = 0.01;
  return (measured != 1 && !angles) || stamped || chance < kRare;
}

std::optional<std::string> copiesIn(const TableOfCase& of) {
  const auto& table = of.table;
  if (!of.readings) return std::nullopt;
  std::map<std::vector<double>, std::size_t> first;
  std::size_t copies = 0;
  std::string pair, but;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const auto [place, is_new] = first.try_emplace(rowOf(of, row), row);
    if (is_new || !tellsCopies(of, row)) continue;
    if (++copies > 1) continue;
    pair = std::to_string(place->second + 1) + " and " + std::to_string(row + 1);
    const auto same = [&](const Column& column) { return column.values[place->second] == column.values[row]; };
    if (!std::ranges::all_of(table.columns, same)) but = " but for whole turns";
  }
  if (copies == 0) return std::nullopt;
  return "rows " + pair + " of table '" + table.name + "' are equal in every digit" + but +
         (copies > 1 ? ", and so are " + std::to_string(copies - 1) + " more" : std::string{}) +
         ": a copy is no reading of its own, and makes the standard deviations too small; remove it";
}

std::string place(const std::string& column, const Table& table) {
  return "column '" + column + "' of table '" + table.name + "'";
}

double farthestOf(const std::vector<double>& values) {
  return std::ranges::max(values, {}, [](double value) { return std::abs(value); });
}

bool isZero(const Column& column) {
  constexpr double kLeastReading = 1e-9;  // of any unit
  return std::ranges::all_of(column.values, [](double value) { return std::abs(value) < kLeastReading; });
}

bool isConstant(const Column& column) {
  return isZero(column) ||
         std::ranges::all_of(column.values, [&](double value) { return value == column.values.front(); });
}

// 0 shows no digits of its own: the finest of the other columns of its kind, or the finest of all where there are none.
double digitOfConstant(const TableOfCase& of, const Column& constant) {
  if (!isZero(constant)) return digitIn(constant.name, constant.values.front());
  const bool is_angle = isInRadians(constant.name);
  double finest = is_angle ? 1 : kFinestDigit;
  for (const auto& column : of.table.columns) {
    if (!isMeasured(of.described(column)) || isZero(column) || isInRadians(column.name) != is_angle) continue;
    for (const double value : column.values) finest = std::min(finest, digitIn(column.name, value));
  }
  return finest;
}

// Whether a promised value depends on a column; readings in a plane may omit a coordinate.
bool isUsed(const TableOfCase& of, const Column& readings) {
  const auto& [dataset, method, table, is_of_readings] = of;
  constexpr double kStep = 1e-6;  // less than any noise, in mm or um
  Dataset moved = dataset;
  auto& values = std::ranges::find(std::ranges::find(moved.tables, table.name, &Table::name)->columns, readings.name,
                                   &Column::name)
                     ->values;
  for (std::size_t row = 0; row < values.size(); ++row)
    values[row] += kStep * static_cast<double>(row * row * row % 11);
  const auto before = method.solver(dataset), after = method.solver(moved);
  if (!before || !after) return true;
  return !std::ranges::equal(before->estimates, after->estimates, [](const Estimate& a, const Estimate& b) {
    return std::ranges::equal(a.values, b.values, [](double was, double is) { return std::abs(is - was) <= 1e-10; });
  });
}

std::optional<Refusal> frozenIn(const TableOfCase& of) {
  const auto& [dataset, method, table, readings] = of;
  if (!readings) return std::nullopt;
  std::set<std::vector<double>> rows;  // copies of one are another slip
  for (std::size_t row = 0; row < table.rows(); ++row) rows.insert(rowOf(of, row));
  if (rows.size() < 2) return std::nullopt;
  // The face of a turning screw changes any sensor, whatever its digits.
  const bool turns = std::ranges::any_of(
      table.columns, [&](const Column& column) { return of.described(column).role == ColumnRole::rotation; });
  for (const auto& column : table.columns) {
    const auto described = of.described(column);
    if (!isMeasured(described) || !isConstant(column)) continue;
    const double digit = digitOfConstant(of, column);
    const double chance = std::pow(chanceOfEqual(dataset, described, digit), static_cast<double>(rows.size() - 1));
    if (!turns && chance >= kNoChance) continue;
    if (isZero(column) && (described.may_be == MayBe::zero || !isUsed(of, column))) continue;
    return Refusal{"frozen-channel",
                   "all " + std::to_string(column.values.size()) + " readings in " + place(column.name, table) +
                       " are " + (isZero(column) ? "0" : text(column.values.front())) +
                       " in every digit: a channel that measures has noise, and no standard deviation "
                       "from these can be believed; check its cable and where the file comes from, "
                       "and measure again"};
  }
  return std::nullopt;
}

// A screw turns from any angle on.
double spanOf(const std::vector<double>& values) {
  const auto [least, greatest] = std::ranges::minmax(values);
  return greatest - least;
}

std::optional<std::string> degreesIn(const TableOfCase& of) {
  const auto& table = of.table;
  if (!of.readings) return std::nullopt;
  for (const auto& column : table.columns) {
    const auto& [name, values] = column;
    if (!isInRadians(name) || values.empty()) continue;
    const bool of_screw = of.described(column).role == ColumnRole::rotation;
    const double farthest = of_screw ? spanOf(values) : farthestOf(values);
    if (std::abs(farthest) <= (of_screw ? kLongestRotation_rad : kFarthestStop_rad)) continue;
    return place(name, table) + " reaches " + text(farthest) + " rad, " +
           text(std::round(farthest / (2 * std::numbers::pi))) + " turns: angles are in radians; are these " +
           (std::abs(farthest) > kMostDegrees ? "milliradians?" : "degrees?");
  }
  return std::nullopt;
}

std::optional<std::string> turnsIn(const TableOfCase& of) {
  const auto& table = of.table;
  if (!of.readings) return std::nullopt;
  for (const auto& [name, values] : table.columns) {
    if (!isInDegrees(name) || values.empty()) continue;
    const double farthest = farthestOf(values);
    if (std::abs(farthest) <= kMostDegrees) continue;
    return place(name, table) + " reaches " + text(farthest) + " degrees, " + text(std::round(farthest / 360)) +
           " turns: angles are in degrees; are these minutes of arc, or was a factor applied twice?";
  }
  return std::nullopt;
}

std::optional<std::string> millimetresIn(const TableOfCase& of) {
  const auto& table = of.table;
  for (const auto& column : table.columns) {
    const auto& [name, values] = column;
    if (!name.ends_with("_um") || values.empty()) continue;
    const double farthest = std::abs(farthestOf(values));
    const bool is_face = of.described(column).role == ColumnRole::face;
    if (farthest >= (is_face ? kLeastFace_um : kLeastReading_um) || farthest == 0) continue;
    return place(name, table) + " stays within " + text(farthest) +
           " um of zero: it is in micrometres; are these millimetres?";
  }
  return std::nullopt;
}

// The sd that is stated for a column, of a coordinate the largest of several; nothing for columns that may be set.
std::optional<StatedNoise> statedNoise(const TableOfCase& of, const MethodColumn& column) {
  const auto* noise = noiseOf(column.role);
  const bool of_position = column.role == ColumnRole::coordinate;
  if (noise == nullptr || column.role == ColumnRole::contact_angle || (of_position && !of.readings))
    return std::nullopt;
  auto stated = statedNoise(of.dataset, *noise);
  for (const auto& [key, value] : of.dataset.config) {
    const auto* number = std::get_if<double>(&value);
    if (stated && of_position && number != nullptr && key.starts_with("sigma_") && key.ends_with("_mm"))
      stated->sd = std::max(stated->sd, *number);
  }
  return stated;
}

// What was set, and what no value depends on, may be whole numbers.
bool isSet(const TableOfCase& of, const Column& column) {
  const auto may_be = of.described(column).may_be;
  return may_be == MayBe::set || (isConstant(column) && may_be == MayBe::zero) || !isUsed(of, column);
}

// Readings whose digits are coarser than the stated sigma: what rounding leaves is in no standard deviation.
std::optional<std::string> coarserThanSigma(const TableOfCase& of) {
  std::string names;
  double coarsest = 0;
  double chance = 1;  // of all columns: two readings of each are few, those of three are not
  StatedNoise noise;
  for (const auto& column : of.table.columns) {
    const auto stated = statedNoise(of, of.described(column));
    if (!stated) continue;
    const auto shown = shownDigit(column.values, std::sqrt(12.0) * stated->sd);
    if (shown.chance >= 1 || isSet(of, column)) continue;
    chance *= shown.chance;
    names += (names.empty() ? "" : ", ") + column.name;
    coarsest = std::max(coarsest, shown.digit);
    noise = *stated;
  }
  if (chance >= kCoarseByChance) return std::nullopt;
  return "the readings of " + names + " in table '" + of.table.name + "' have digits of " + text(coarsest) +
         noise.unit + ": rounding alone is an sd of " + text(coarsest / std::sqrt(12.0)) + noise.unit +
         ", more than the sigma of " + text(noise.sd) + noise.unit +
         " that is stated; read more digits, or state that sd as " + noise.key;
}

std::optional<std::string> millisecondsIn(const TableOfCase& of) {
  for (const auto& column : of.table.columns) {
    if (of.described(column).role != ColumnRole::stamp || column.values.empty()) continue;
    const double covered_s = spanOf(column.values);
    if (covered_s <= (column.name == column::kReadAt.name ? kLongestDay_s : kLongestStream_s)) continue;
    return place(column.name, of.table) + " covers " + text(covered_s) + " s, " +
           text(std::round(covered_s / 360) / 10) + " hours: times are in seconds; are these milliseconds?";
  }
  return std::nullopt;
}

// Looks at each table of the case that its method describes.
template <auto look>
std::optional<Refusal> inTables(const Dataset& dataset, const Method& method, Result& result) {
  for (const auto& described : method.tables) {
    const Table* table = dataset.table(described.name);
    if (table == nullptr) continue;
    auto found = look({dataset, method, *table, described.readings});
    if (!found) continue;
    if constexpr (std::is_same_v<decltype(found), std::optional<Refusal>>)
      return found;
    else
      result.warnings.push_back(*std::move(found));
  }
  return std::nullopt;
}

std::optional<Refusal> impossibleAnswer(const Dataset&, const Method& method, Result& result) {
  return refuseImplausible(result, method);
}

std::optional<Refusal> warnOfUnusedKeys(const Dataset& dataset, const Method& method, Result& result) {
  for (auto& sentence : unusedKeys(dataset, method)) result.warnings.push_back(std::move(sentence));
  return std::nullopt;
}

constexpr Check kChecks[]{
    {"implausible", "every number of the case", "no machine tool has it in the unit that its column or key names",
     refuseImplausible},
    {"implausible", "promised values, their sd and uncertainty", "beyond the unit's limits or the value's own", nullptr,
     impossibleAnswer},
    {"frozen-channel", "measured columns of readings",
     "all values equal in every digit that the noise would have changed", nullptr, inTables<frozenIn>},
    {"unused key", "configuration", "warns of a key that the method does not take", nullptr, warnOfUnusedKeys},
    {"millimetres", "columns in um", "warns of values that stay within 0.1 um of zero", nullptr,
     inTables<millimetresIn>},
    {"milliseconds", "stamps", "warns of stamps that cover more than two hours", nullptr, inTables<millisecondsIn>},
    {"coarse digits", "readings with a stated sigma", "warns of digits whose rounding exceeds the sigma", nullptr,
     inTables<coarserThanSigma>},
    {"copies", "tables of readings", "warns of rows that are equal in every digit, whole turns aside", nullptr,
     inTables<copiesIn>},
    {"degrees", "angles of readings in rad",
     "warns of more than two turns, of a slow rotation of a screw more than fifty", nullptr, inTables<degreesIn>},
    {"turns", "angles of readings in degrees", "warns of more than two turns", nullptr, inTables<turnsIn>},
    {kNoRedundancy, "results", "warns where there are as many readings as unknowns", nullptr, warnOfNoRedundancy},
    {kUnusualScatter, "results without a stated sigma", "warns of readings that scatter by more than 0.02 mm (k = 1)",
     nullptr, warnOfUnusualScatter},
    {kLengthsInInches, "readings with a stated sigma", "warns of readings that scatter by a twelfth of it or less",
     nullptr, warnOfInches},
    {kUnusualLength, "lengths with a usual size", "warns of a size that a machine tool seldom has, such as inches",
     nullptr, warnOfUnusualLengths},
};

}  // namespace

std::span<const Check> checks() {
  return kChecks;
}

}  // namespace probebox::metrology
