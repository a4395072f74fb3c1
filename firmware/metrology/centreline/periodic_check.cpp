#include "firmware/metrology/centreline/periodic_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/centreline/centreline.hpp"
#include "firmware/metrology/centreline/check_quantities.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/verdict.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/shared_errors.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr MethodColumn kCentreColumns[]{column::kB, column::kCDegrees, column::kADegrees,
                                        column::kX, column::kY,        column::kZ};
constexpr MethodColumn kCentreColumnsOfXZ[]{column::kB, column::kCDegrees, column::kADegrees, column::kX, column::kZ};
constexpr MethodColumn kAllCentreColumns[]{
    column::kB, column::kCDegrees, column::kADegrees, column::kX, column::kY.orBe(MayBe::missing), column::kZ};
constexpr MethodColumn kXColumns[]{column::kB, column::kCDegrees, column::kADegrees, column::kX};
constexpr MethodColumn kZColumns[]{column::kB, column::kCDegrees, column::kADegrees, column::kZ};

// A lathe of X and Z has no head, and no spindle that turns the stylus: what of that cancels is not asked for.
std::optional<Refusal> badAngles(const Table& table, bool without_y) {
  const auto wrong = [&](std::string_view column, std::size_t row, const char* allowed) {
    return Refusal{"bad-angle", "table '" + table.name + "', column '" + std::string{column} + "', row " +
                                    std::to_string(row + 1) + ": the check is defined at " + allowed +
                                    " degrees; read the ball there"};
  };
  for (std::size_t row = 0; row < table.rows(); ++row) {
    for (const std::string_view column : {column::kCDegrees, column::kADegrees}) {
      if (std::abs(std::remainder((*table.column(column))[row], 180.0)) > kSameAngle_deg) {
        return wrong(column, row, "0 and 180");
      }
    }
    const double swivel = (*table.column(column::kB))[row];
    const auto same = [&](double angle) { return std::abs(swivel - angle) <= kSameAngle_deg; };
    if (without_y && !same(0.0)) return wrong(column::kB, row, "0, on a machine without Y,");
    if (!same(0.0) && !same(45.0) && !same(90.0)) return wrong(column::kB, row, "0, 45 and 90");
  }
  return std::nullopt;
}

// 1 at 0 degrees, -1 at 180.
double side(double degrees) {
  return std::abs(std::remainder(degrees, 360.0)) < 90.0 ? 1.0 : -1.0;
}

// Standard deviations of one coordinate of a centre, of its height at B = 90, of a single touch, and of a stop of C.
struct Sigmas {
  StatedNoise centre;
  double height90{1.0};
  double touch{1.0};

  double of(const CheckQuantity& quantity) const {
    if (quantity.table != "centres") return touch;
    return quantity.column == column::kZ.name ? height90 : centre.noise.position;
  }
};

Outcome<Sigmas, Refusal> sigmasOf(const Dataset& dataset) {
  TRY(auto centre, statedNoise(dataset));
  TRY(const auto touch, configPositive(dataset, "sigma_touch_mm"));
  TRY(const auto height90, configPositive(dataset, "sigma_Zcen_B90_mm"));
  if ((touch || height90) && !centre.stated) {
    return Refusal{"missing-key", std::string{"config.json states "} +
                                      (touch ? "sigma_touch_mm" : "sigma_Zcen_B90_mm") +
                                      " without sigma_mm: state both, or neither"};
  }
  const double usual = centre.noise.position;
  return Sigmas{std::move(centre), height90.value_or(usual), touch.value_or(usual)};
}

// All means as one linear fit, so that residuals and degrees of freedom are common to them.
struct Means {
  std::vector<const CheckQuantity*> quantities;
  std::vector<Eigen::Index> columns;  // of each quantity's mean
  std::vector<std::string> readings;  // name of each row
  std::vector<double> swivels;        // degrees, of each row
  std::vector<double> sigmas;         // of each row
  std::vector<double> stops;          // of C, of each row
  std::vector<std::string> warnings;
  Fit fit;
};

// Number of the pose of a row. C comes to each pose anew.
double poseOf(const Table& table, std::size_t row) {
  const auto turned = [&](std::string_view column) { return side((*table.column(column))[row]) < 0 ? 1.0 : 0.0; };
  return 4 * std::round((*table.column(column::kB))[row] / 45.0) + 2 * turned(column::kCDegrees) +
         turned(column::kADegrees);
}

struct Row {
  double value{};
  Eigen::Index mean{};
  double ball{};
  double stylus{};
  const CheckQuantity* quantity{};
};

// Offset of the ball from the C axis at C = 0, in X or Y; nothing where no reading tells it.
std::optional<double> ballOffset(const Means& means, std::string_view column, bool x_is_radius) {
  for (std::size_t k = 0; k < means.quantities.size(); ++k) {
    const CheckQuantity& quantity = *means.quantities[k];
    if (!quantity.ball || quantity.column != column) continue;
    const double offset = means.fit.parameters[means.columns[k] + 1];
    return quantity.table == "x_touch" && !x_is_radius ? offset / 2 : offset;
  }
  return std::nullopt;
}

// Returns how far one sd of the angle of C moves each row, in sds of the row; nothing where the ball's offset is not
// known.
std::optional<Eigen::VectorXd> movedByC(const Means& means, std::span<const Row> rows, double sigma_rad,
                                        bool x_is_radius) {
  const auto x = ballOffset(means, column::kX, x_is_radius);
  const auto y = ballOffset(means, column::kY, x_is_radius);
  if (!x || !y) return std::nullopt;
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(rows.size()));
  for (std::size_t k = 0; k < rows.size(); ++k) {
    const CheckQuantity& quantity = *rows[k].quantity;
    const double in_sds = rows[k].ball * sigma_rad / means.sigmas[k];
    const double shown = quantity.table == "x_touch" && !x_is_radius ? 2.0 : 1.0;
    if (quantity.column == column::kX.name) moved[static_cast<Eigen::Index>(k)] = -shown * in_sds * *y;
    if (quantity.column == column::kY.name) moved[static_cast<Eigen::Index>(k)] = in_sds * *x;
  }
  return moved;
}

// Not told by a machine without Y.
bool isOfY(const CheckQuantity& quantity, bool without_y) {
  return without_y && quantity.column == column::kY.name;
}

Outcome<Means, Refusal> fitMeans(const Dataset& dataset, const Sigmas& sigmas, bool x_is_radius, bool without_y) {
  Means means;
  std::vector<Row> rows;
  Eigen::Index parameters = 0;
  for (const CheckQuantity* each : kCheckQuantities) {
    const CheckQuantity& quantity = *each;
    const bool stylus = quantity.stylus && !without_y;
    if (dataset.table(quantity.table) == nullptr || isOfY(quantity, without_y)) continue;
    const Table& table = *dataset.table(quantity.table);
    const std::size_t before = rows.size();
    for (std::size_t row = 0; row < table.rows(); ++row) {
      if (std::abs((*table.column(column::kB))[row] - quantity.swivel) > kSameAngle_deg) continue;
      means.readings.push_back(table.name + " " + std::to_string(row + 1) + ", " + std::string{quantity.column});
      means.swivels.push_back(quantity.swivel);
      means.sigmas.push_back(sigmas.of(quantity));
      means.stops.push_back(poseOf(table, row));
      rows.push_back({(*table.column(quantity.column))[row], parameters,
                      quantity.ball ? side((*table.column(column::kCDegrees))[row]) : 0.0,
                      stylus ? side((*table.column(column::kADegrees))[row]) : 0.0, &quantity});
    }
    if (rows.size() == before) continue;
    means.quantities.push_back(&quantity);
    means.columns.push_back(parameters);
    parameters += 1 + (quantity.ball ? 1 : 0) + (stylus ? 1 : 0);
  }
  if (rows.empty())
    return Refusal{"missing-orientation",
                   "no reading is at the angle for which its table is named: read the ball there"};
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(rows.size()), parameters);
  Eigen::VectorXd values{design.rows()};
  for (Eigen::Index k = 0; k < design.rows(); ++k) {
    const Row& row = rows[static_cast<std::size_t>(k)];
    const double weight = 1.0 / means.sigmas[static_cast<std::size_t>(k)];
    design(k, row.mean) = weight;
    if (row.ball != 0.0) design(k, row.mean + 1) = weight * row.ball;
    if (row.stylus != 0.0) design(k, row.mean + (row.ball != 0.0 ? 2 : 1)) = weight * row.stylus;
    values[k] = weight * row.value;
  }
  auto fit = linearLeastSquares(design, values);
  if (!fit) {
    return Refusal{"missing-orientation",
                   "the run-out of ball and stylus does not cancel: read every centre with C and spindle at 0 and 180 "
                   "degrees, and X with C at 0 and 180"};
  }
  means.fit = std::move(fit).value();
  const double sigma_c = sigmas.centre.noise.angle;
  if (sigma_c <= 0) return means;
  const auto moved = movedByC(means, rows, sigma_c, x_is_radius);
  if (!moved) {
    means.warnings.emplace_back(
        std::string{"sigma_C_rad is not used: no reading tells how far the ball is from the C axis in "} +
        (without_y ? "Y" : "X"));
    return means;
  }
  shareErrors(design, values, *moved, means.stops);
  TRY(means.fit, linearLeastSquares(design, values));
  return means;
}

struct Ball {
  double radius{};
  double expected_z{};
  bool x_is_radius{true};
};

Outcome<Ball, Refusal> ballOf(const Dataset& dataset) {
  TRY(const auto radius, requiredPositive(dataset, "effective_ball_radius_mm"));
  TRY(const auto expected, requiredNumber(dataset, "expected_ball_centre_z_mm"));
  if (!dataset.config.contains("x_is_radius")) {
    return Refusal{"missing-key",
                   "config.json has no key 'x_is_radius': give true, or false when X is programmed in diameter"};
  }
  TRY(const auto x_is_radius, configSwitch(dataset, "x_is_radius"));
  return Ball{radius, expected, x_is_radius};
}

// (B24): what to take off the mean of the touches.
double reference(const CheckQuantity& quantity, const Ball& ball) {
  if (quantity.table == "x_touch") return ball.x_is_radius ? ball.radius : 2.0 * ball.radius;
  if (quantity.table == "z_touch") return ball.radius + ball.expected_z;
  return 0.0;
}

// Run-outs of ball and stylus at C = 0 and spindle = 0, from x and y at B = 0, and where the ball is: what the next
// check starts from once this one is accepted.
std::optional<Refusal> addRunOuts(Answer& answer, const Means& means, const Ball& ball) {
  constexpr std::array wanted{&kXAtLevel, &kYAtLevel};
  std::array<Eigen::Index, 2> at{};
  for (std::size_t k = 0; k < 2; ++k) {
    const auto found = std::ranges::find(means.quantities, wanted[k]);
    if (found == means.quantities.end()) return std::nullopt;
    at[k] = means.columns[static_cast<std::size_t>(found - means.quantities.begin())];
  }
  const auto& parameters = means.fit.parameters;
  const double stylus_mm = std::hypot(parameters[at[0] + 2], parameters[at[1] + 2]);
  if (auto refusal = refuseStylusOff(stylus_mm, "table 'centres'",
                                     "the signs and units of x_mm and y_mm, and the angles at B = 0"))
    return refusal;
  const auto one = [&](Eigen::Index column) { return Eigen::RowVectorXd{pick(column, 1, parameters.size()).row(0)}; };
  for (std::size_t k = 0; k < kCheckRunOuts.size(); ++k) {
    const bool stylus = k >= 2;
    const double sign = stylus ? -1.0 : 1.0;  // (B4): the stylus is taken off
    const Eigen::Index column = at[k % 2] + (stylus ? 2 : 1);
    answer.alsoScalar(std::string{kCheckRunOuts[k]}, sign * parameters[column], sign * one(column));
  }
  Eigen::VectorXd centre{3};
  Eigen::MatrixXd rows{3, parameters.size()};
  for (Eigen::Index k = 0; k < 2; ++k) {
    const Eigen::Index mean = at[static_cast<std::size_t>(k)];
    centre[k] = parameters[mean] + parameters[mean + 1];
    rows.row(k) = one(mean) + one(mean + 1);
  }
  const auto z = std::ranges::find(means.quantities, &kZAtLevel);
  if (z == means.quantities.end()) return std::nullopt;
  const Eigen::Index touched = means.columns[static_cast<std::size_t>(z - means.quantities.begin())];
  centre[2] = parameters[touched] - ball.radius;
  rows.row(2) = one(touched);
  answer.alsoVector(quantity::kBallCentre, centre, rows);
  return std::nullopt;
}

// The same of a lathe of X and Z.
void addRunOutOfXZ(Answer& answer, const Means& means, const Ball& ball) {
  const auto one = [&](Eigen::Index column) {
    return Eigen::RowVectorXd{pick(column, 1, means.fit.parameters.size()).row(0)};
  };
  for (std::size_t k = 0; k < means.quantities.size(); ++k) {
    const Eigen::Index mean = means.columns[k];
    const double value = means.fit.parameters[mean];
    if (means.quantities[k] == &kXAtLevel)
      answer.alsoScalar(std::string{kCheckRunOuts[0]}, means.fit.parameters[mean + 1], one(mean + 1));
    if (means.quantities[k] == &kZAtLevel) answer.alsoScalar(quantity::kBallCentreZ, value - ball.radius, one(mean));
  }
}

bool hasSwivel(const Table& table, double swivel) {
  return std::ranges::any_of(*table.column(column::kB),
                             [&](double b) { return std::abs(b - swivel) <= kSameAngle_deg; });
}

// X is touched at B = 90 and Z at 0, where the centres were read as well: a check without that angle needs no table.
std::optional<Refusal> badTables(const Dataset& dataset, bool without_y) {
  const std::span<const MethodColumn> columns{without_y ? std::span<const MethodColumn>{kCentreColumnsOfXZ}
                                                        : std::span<const MethodColumn>{kCentreColumns}};
  TRY(const auto centres, checkedTable(dataset, "centres", columns));
  if (auto refusal = badAngles(*centres, without_y)) return refusal;
  struct Touches {
    std::string_view name;
    std::span<const MethodColumn> columns;
    double swivel{};  // degrees
  };
  for (const auto& touches : {Touches{"x_touch", kXColumns, 90.0}, Touches{"z_touch", kZColumns, 0.0}}) {
    if (dataset.table(touches.name) == nullptr && !hasSwivel(*centres, touches.swivel)) continue;
    TRY(const auto table, checkedTable(dataset, touches.name, touches.columns));
    if (auto refusal = badAngles(*table, without_y)) return refusal;
  }
  return std::nullopt;
}

constexpr double kContradict = 5.0;  // sd
// Chosen: readings of a check are minutes apart, and a touch on the top has a pre-travel of its own.
constexpr double kLeastContradiction_mm = 0.01, kLeastContradictionZ_mm = 0.05;

// Run-out of the ball in X at B = 90: half the difference of the means at C = 0 and 180.
struct RunOutX {
  double mm{};
  double variance{};  // for unit sigma
};

std::optional<RunOutX> runOutX(const Table& table) {
  std::array<double, 2> sums{}, counts{};
  for (std::size_t row = 0; row < table.rows(); ++row) {
    if (std::abs((*table.column(column::kB))[row] - kXAt90.swivel) > kSameAngle_deg) continue;
    const std::size_t at = side((*table.column(column::kCDegrees))[row]) > 0 ? 0 : 1;
    sums[at] += (*table.column(column::kX))[row];
    counts[at] += 1;
  }
  if (counts[0] == 0 || counts[1] == 0) return std::nullopt;
  return RunOutX{(sums[0] / counts[0] - sums[1] / counts[1]) / 2, (1 / counts[0] + 1 / counts[1]) / 4};
}

// The touches along X and the centres at B = 90 show the same run-out of the ball.
std::optional<Refusal> contradictionX(const Dataset& dataset, const Means& means, const Sigmas& sigmas,
                                      bool x_is_radius) {
  const Table* table = dataset.table("x_touch");
  if (table == nullptr || !sigmas.centre.stated) return std::nullopt;
  const auto touched = runOutX(*table), centred = runOutX(*dataset.table("centres"));
  if (!touched || !centred) return std::nullopt;
  const double shown = x_is_radius ? 1.0 : 2.0;
  const double differ_mm = std::abs(touched->mm / shown - centred->mm);
  const double stop_mm = sigmas.centre.noise.angle * ballOffset(means, column::kY, x_is_radius).value_or(0.0);
  const double sd_mm = std::hypot(sigmas.touch / shown * std::sqrt(touched->variance),
                                  sigmas.centre.noise.position * std::sqrt(centred->variance), stop_mm);
  if (differ_mm <= std::max(kContradict * sd_mm, kLeastContradiction_mm)) return std::nullopt;
  return Refusal{"readings-contradict",
                 "at B = 90 the ball's run-out in X is " + text(touched->mm / shown) + " mm by table x_touch and " +
                     text(centred->mm) +
                     " mm by table centres: one of the readings is wrong, or x_is_radius is; read both again"};
}

// The head turns about Y, which leaves the run-outs of ball and stylus in Y as they are.
std::optional<Refusal> contradictionY(const Means& means, const Sigmas& sigmas) {
  if (!sigmas.centre.stated) return std::nullopt;
  const auto& found = means.fit.parameters;
  const auto variance = [&](Eigen::Index at) { return means.fit.cofactor(at, at); };
  std::optional<std::size_t> first;
  for (std::size_t k = 0; k < means.quantities.size(); ++k) {
    if (means.quantities[k]->column != column::kY.name) continue;
    if (!first) first = k;
    for (const Eigen::Index part : {1, 2}) {  // ball, stylus
      const Eigen::Index here = means.columns[k] + part, there = means.columns[*first] + part;
      const double sd_mm = std::sqrt(variance(here) + variance(there));
      const double differ_mm = std::abs(found[here] - found[there]);
      if (differ_mm <= std::max(kContradict * sd_mm, kLeastContradiction_mm)) continue;
      return Refusal{"readings-contradict", std::string{part == 1 ? "the ball" : "the stylus"} +
                                                "'s run-out in Y at B = " + text(means.quantities[k]->swivel) + " is " +
                                                text(differ_mm) +
                                                " mm off that at B = " + text(means.quantities[*first]->swivel) +
                                                ": read y_mm of table centres again at both"};
    }
  }
  return std::nullopt;
}

// The touch on the top and the centres at B = 0 show the same height of the ball.
std::optional<std::string> contradictionZ(const Dataset& dataset, const Sigmas& sigmas, const Ball& ball) {
  if (dataset.table("z_touch") == nullptr || !sigmas.centre.stated) return std::nullopt;
  const auto heights = [&](const Table& table) {
    std::vector<double> found;
    for (std::size_t row = 0; row < table.rows(); ++row)
      if (std::abs((*table.column(column::kB))[row]) <= kSameAngle_deg)
        found.push_back((*table.column(column::kZ))[row]);
    return found;
  };
  const auto tops = heights(*dataset.table("z_touch")), centres = heights(*dataset.table("centres"));
  if (tops.empty() || centres.empty()) return std::nullopt;
  const auto [lowest, highest] = std::ranges::minmax(centres);
  if (centres.size() > 1 && lowest == highest) return std::nullopt;  // set, not measured
  const auto count = static_cast<double>(tops.size());
  const double touched = std::accumulate(tops.begin(), tops.end(), 0.0) / count - ball.radius;
  const double sd_mm = std::hypot(sigmas.touch / std::sqrt(count), sigmas.centre.noise.position);
  const double beyond_mm = std::max(lowest - touched, touched - highest);
  if (beyond_mm <= std::max(kContradict * sd_mm, kLeastContradictionZ_mm)) return std::nullopt;
  return "by table z_touch the ball's centre is at Z = " + text(touched) + " mm, and by table centres at " +
         text(lowest) + " to " + text(highest) + " mm at B = 0: read both again, and check effective_ball_radius_mm";
}

}  // namespace

Outcome<Result, Refusal> solvePeriodicCheck(const Dataset& dataset) {
  TRY(const auto ball, ballOf(dataset));
  TRY(const auto sigmas, sigmasOf(dataset));
  TRY(const auto axes, configWord(dataset, key::kMachineAxes.name, key::kAxesOfMachines));
  const bool without_y = axes == key::kAxesOfMachines[1];
  if (auto refusal = badTables(dataset, without_y)) return *refusal;
  TRY(const auto stop90, configPositive(dataset, "sigma_stop_B90_mm"));
  TRY(const auto means, fitMeans(dataset, sigmas, ball.x_is_radius, without_y));
  if (auto refusal = contradictionX(dataset, means, sigmas, ball.x_is_radius)) return *refusal;
  if (auto refusal = contradictionY(means, sigmas)) return *refusal;
  const auto& parameters = means.fit.parameters;
  Answer answer{dataset, means.fit, sigmas.centre.sigma()};
  for (const auto& warnings : {sigmas.centre.warnings, means.warnings}) {
    for (const auto& warning : warnings) answer.warn(warning);
  }
  if (auto warning = contradictionZ(dataset, sigmas, ball)) answer.warn(std::move(*warning));
  answer.readings(means.readings, means.swivels, column::kB);
  auto& residuals = answer.result().residuals.values;
  for (std::size_t k = 0; k < residuals.size(); ++k) residuals[k] *= means.sigmas[k] / sigmas.centre.noise.position;
  for (std::size_t k = 0; k < means.quantities.size(); ++k) {
    const CheckQuantity& quantity = *means.quantities[k];
    const Eigen::RowVectorXd row = pick(means.columns[k], 1, parameters.size()).row(0);
    const double value = parameters[means.columns[k]] - reference(quantity, ball);
    if (quantity.promised) {
      answer.promiseScalar(std::string{quantity.key}, value, row);
      continue;
    }
    answer.alsoScalar(std::string{quantity.key}, value, row);
    // Zcen_B90_mm: one stop of B for all of its readings, whose scatter does not show it.
    auto& sd = answer.result().also.back().sd;
    if (!sd.empty()) sd[0] = std::hypot(sd[0], stop90.value_or(0.0));
  }
  if (without_y) addRunOutOfXZ(answer, means, ball);
  if (auto refusal = addRunOuts(answer, means, ball)) return *refusal;
  for (const CheckQuantity* quantity : kCheckQuantities) {
    if (std::ranges::find(means.quantities, quantity) != means.quantities.end()) continue;
    const std::string key{quantity->key};
    const std::string why =
        isOfY(*quantity, without_y) ? ": no axis of the machine moves along Y" : ": no reading at its swivel angle";
    // A machine whose head does not swivel has none of them; one that was accepted is missed.
    if (dataset.config.contains("accepted_" + key)) {
      answer.warn(key + " was accepted once and is not measured now" + why);
    } else {
      answer.result().unobservable.push_back(key + why);
    }
  }
  answer.result().convention = ball.x_is_radius ? "X in radius" : "X in diameters";
  return std::move(answer).take(true);
}

namespace {

constexpr MethodTable kPeriodicCheckTables[]{
    {"centres", kAllCentreColumns,
     "centre of the ball at B 0, 45 or 90, C and A 0 or 180; column y_mm too, but on a lathe of X and Z", true},
    {"x_touch", kXColumns, "a touch along X at B = 90; needed if table centres is given", true},
    {"z_touch", kZColumns, "a touch along Z at B = 0; needed if table centres is given", true}};
constexpr std::string_view kAccepted = "the value in the accepted calibration";
constexpr std::string_view kSdAccepted =
    "standard deviation of the accepted value (k = 1), included in U of the deviation; without it, taken as exact";
constexpr std::string_view kLimit = "largest deviation from the accepted value that is allowed";
constexpr MethodKey kPeriodicCheckKeys[]{
    MethodKey{"effective_ball_radius_mm", kNeeded, "of ball plus stylus ball"}.within(0.05, 500),
    {"expected_ball_centre_z_mm", kNeeded, "Z of the ball's centre at B = 0"},
    {"x_is_radius", kNeeded, "false where X is programmed in diameters"},
    key::kMachineAxes,
    key::kSigma,
    key::kSigmaC,
    key::kLengthResults[0],
    key::kLengthResults[1],
    key::kLengthResults[2],
    key::kLengthResults[3],
    {"sigma_touch_mm", "sigma_mm", "standard deviation of one touch (k = 1)"},
    {"sigma_stop_B90_mm", "0", "standard deviation of Zcen_B90_mm due to a stop of B (k = 1)"},
    {"sigma_Zcen_B90_mm", "sigma_mm", "standard deviation of the height of one centre at B = 90 (k = 1)"},
    {"limit_mm", "", "the same for every value without a limit of its own"},
    key::kTauForTheRecord,
    {"accepted_ball_offset_x_mm", "", kAccepted},
    {"sd_accepted_ball_offset_x_mm", "", kSdAccepted},
    {"limit_ball_offset_x_mm", "limit_mm", kLimit},
    {"accepted_ball_offset_y_mm", "", kAccepted},
    {"sd_accepted_ball_offset_y_mm", "", kSdAccepted},
    {"limit_ball_offset_y_mm", "limit_mm", kLimit},
    {"accepted_stylus_offset_x_mm", "", kAccepted},
    {"sd_accepted_stylus_offset_x_mm", "", kSdAccepted},
    {"limit_stylus_offset_x_mm", "limit_mm", kLimit},
    {"accepted_stylus_offset_y_mm", "", kAccepted},
    {"sd_accepted_stylus_offset_y_mm", "", kSdAccepted},
    {"limit_stylus_offset_y_mm", "limit_mm", kLimit},
    {"accepted_Xcen_B0_mm", "", kAccepted},
    {"sd_accepted_Xcen_B0_mm", "", kSdAccepted},
    {"limit_Xcen_B0_mm", "limit_mm", kLimit},
    {"accepted_Ycen_B0_mm", "", kAccepted},
    {"sd_accepted_Ycen_B0_mm", "", kSdAccepted},
    {"limit_Ycen_B0_mm", "limit_mm", kLimit},
    {"accepted_z_offset_error_mm", "0", kAccepted},
    {"sd_accepted_z_offset_error_mm", "", kSdAccepted},
    {"limit_z_offset_error_mm", "limit_mm", kLimit},
    {"accepted_Ycen_B45_mm", "", kAccepted},
    {"sd_accepted_Ycen_B45_mm", "", kSdAccepted},
    {"limit_Ycen_B45_mm", "limit_mm", kLimit},
    {"accepted_Ycen_B90_mm", "", kAccepted},
    {"sd_accepted_Ycen_B90_mm", "", kSdAccepted},
    {"limit_Ycen_B90_mm", "limit_mm", kLimit},
    {"accepted_Zcen_B90_mm", "", kAccepted},
    {"sd_accepted_Zcen_B90_mm", "", kSdAccepted},
    {"limit_Zcen_B90_mm", "limit_mm", kLimit},
    {"accepted_x_offset_error_mm", "0", kAccepted},
    {"sd_accepted_x_offset_error_mm", "", kSdAccepted},
    {"limit_x_offset_error_mm", "limit_mm", kLimit}};
constexpr KnownQuantity kKnown[]{
    {"sd_effective_ball_radius_mm", "effective_ball_radius_mm", KnownKind::size, false, "radius of the checked ball"},
    {"sd_expected_ball_centre_z_mm", "expected_ball_centre_z_mm", KnownKind::value, false,
     "accepted height of the checked ball"}};
constexpr double kMostOffsetError_mm = 10;  // of a machine that still moves
constexpr Quantity kPeriodicCheckResults[]{
    {.key = kXAtLevel.key, .about = "mean X of the ball at B = 0", .kind = QuantityKind::offset},
    {.key = kYAtLevel.key, .about = "mean Y at B = 0", .kind = QuantityKind::offset},
    {.key = kZAtLevel.key,
     .about = "Z offset error at B = 0 (B24)",
     .kind = QuantityKind::error,
     .most = kMostOffsetError_mm},
    {.key = kYAt45.key, .about = "mean Y at B = 45", .kind = QuantityKind::offset},
    {.key = kYAt90.key, .about = "mean Y at B = 90", .kind = QuantityKind::offset},
    {.key = kXAt90.key,
     .about = "X offset error at B = 90 (B24)",
     .kind = QuantityKind::error,
     .most = kMostOffsetError_mm}};
constexpr Quantity kPeriodicCheckFurther[]{
    quantity::kDeviation, quantity::kStylusOffsetX, quantity::kStylusOffsetY, {.key = kVerdict}, {.key = kWorstRatio}};
constexpr std::string_view kPeriodicCheckUnobservable[]{
    "run-out of ball and stylus at B = 45 and 90: it cancels",
    "x_offset_error_mm and z_offset_error_mm separately from errors of the ball's radius and expected centre"};

std::vector<NamedSubject> stylusOfCheck(const Dataset& dataset) {
  return {{.name = stylusOffsetSubject(probeToolOf(dataset)),
           .needs = std::string{quantity::kStylusOffsetX},
           .independent_of = key::kLengthResults}};
}

}  // namespace

const Method kPeriodicCheck{.name = "periodic-check",
                            .title = "Periodic check",
                            .equations = "(B23), (B24)",
                            .source = source::kMachine,
                            .solver = solvePeriodicCheck,
                            .judge = judgePeriodicCheck,
                            .tables = kPeriodicCheckTables,
                            .keys = kPeriodicCheckKeys,
                            .known = kKnown,
                            .results = kPeriodicCheckResults,
                            .further = kPeriodicCheckFurther,
                            .unobservable = kPeriodicCheckUnobservable,
                            .subject = {.about = Subject{SubjectKind::check}},
                            .also_about = stylusOfCheck};

}  // namespace probebox::metrology
