#include "firmware/metrology/centreline/rim_steps.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/centreline/ball_readings.hpp"
#include "firmware/metrology/centreline/centreline.hpp"
#include "firmware/metrology/centreline/limited_access.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/table_columns.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr MethodColumn kHeight = column::kZ.orBe(MayBe::missing);
constexpr MethodColumn kColumns[]{column::number("loop"), column::kCClockwise, column::kX, column::kY, kHeight};
constexpr MethodColumn kStylusColumns[]{column::kA, column::kX, column::kY, kHeight};
constexpr double kDisagree = 4.0;  // sd

using Loop = std::vector<RimReading>;  // angles from the zero in force

// How far the stylus is off the spindle, in every reading alike, and what that is uncertain by: nothing along the
// spindle.
struct StylusOffset {
  Vector3d offset{0.0, 0.0, 0.0};
  Vector3d variance{0.0, 0.0, 0.0};  // for readings of unit sigma
  bool flat{true};                   // it points along Z, so the offset is in x and y alone
};

// Those two coordinates of the table stylus that are across the spindle: x and y where the stylus points along Z, z and
// another one where it lies in the x-y plane.
std::vector<std::size_t> acrossSpindle(const Table& stylus) {
  std::vector<std::size_t> across;
  for (std::size_t k = 0; k < std::size(column::kPosition); ++k) {
    if (stylus.column(column::kPosition[k])) across.push_back(k);
  }
  return across.size() == 2 ? across : std::vector<std::size_t>{0, 1};
}

// Step 1, (B11): readings with the spindle half a turn apart; the later ones are made with the spindle at zero.
Outcome<StylusOffset, Refusal> stylusOffset(const Dataset& dataset) {
  const Table* offered = dataset.table("stylus");
  if (!offered) return StylusOffset{};
  const auto across = acrossSpindle(*offered);
  const ColumnNames columns{column::kA, column::kPosition[across[0]], column::kPosition[across[1]]};
  TRY(checkedTable(dataset, "stylus", columns));
  const auto notOpposite = [](const std::string& where) {
    return Refusal{"not-opposite", where + " needs readings with the spindle at 0 and at 180 degrees"};
  };
  const Eigen::MatrixXd rows = columnsOf(*offered, columns);
  std::array<Vector2d, 2> sums{Vector2d::Zero(), Vector2d::Zero()};
  std::array<double, 2> counts{};
  for (Eigen::Index row = 0; row < rows.rows(); ++row) {
    const double angle = std::remainder(rows(row, 0), kTurn);
    const bool zero = std::abs(angle) <= kPoseTolerance_rad;
    if (!zero && std::abs(std::abs(angle) - std::numbers::pi) > kPoseTolerance_rad) {
      return notOpposite("table 'stylus', row " + std::to_string(row + 1) + ", is at neither angle: the table");
    }
    sums[zero ? 0 : 1] += rows.row(row).tail<2>().transpose();
    counts[zero ? 0 : 1] += 1.0;
  }
  if (counts[0] == 0.0 || counts[1] == 0.0) return notOpposite("table 'stylus'");
  const Vector2d half = (sums[1] / counts[1] - sums[0] / counts[0]) / 2.0;
  if (auto refusal = refuseStylusOff(half.norm(), "table 'stylus'",
                                     "the signs and units of its readings, and that C does not turn between them")) {
    return *refusal;
  }
  StylusOffset stylus{.flat = across[1] == 1};
  for (std::size_t k = 0; k < across.size(); ++k) {
    const auto at = static_cast<Eigen::Index>(across[k]);
    stylus.offset[at] = half[static_cast<Eigen::Index>(k)];
    stylus.variance[at] = (1.0 / counts[0] + 1.0 / counts[1]) / 4.0;
  }
  return stylus;
}

Outcome<std::vector<Loop>, Refusal> loopsOf(const Table& table, const Vector2d& stylus) {
  std::vector<Loop> loops;
  for (std::size_t row = 0; row < table.rows(); ++row) {
    const auto value = [&](std::size_t k) { return (*table.column(kColumns[k]))[row]; };
    const double loop = value(0);
    if (loop != std::floor(loop) || loop < 1.0 || loop > static_cast<double>(loops.size() + 1)) {
      return Refusal{"bad-loop", "table 'readings', row " + std::to_string(row + 1) +
                                     ": loops are counted 1, 2, .. as they were measured; number them so"};
    }
    if (loop > kMostRimLoops) {
      return Refusal{"too-many-loops",
                     "the zero of C does not converge within 5 loops: check the ball and the drive for looseness"};
    }
    loops.resize(std::max(loops.size(), static_cast<std::size_t>(loop)));
    loops[static_cast<std::size_t>(loop) - 1].push_back({Vector2d{value(2), value(3)} + stylus, value(1)});
  }
  return loops;
}

// The readings of one loop.
Outcome<RimSteps, Refusal> stepsOf(const Loop& loop, std::size_t number, bool last) {
  const auto steps = rimStepsOf(loop);
  if (!steps || (last && !steps->zero_read)) {
    return Refusal{"missing-step", "loop " + std::to_string(number) + " needs readings at +theta and -theta" +
                                       (last ? ", and at C = 0" : "")};
  }
  if (steps->theta < kLeastHalfArc_rad) {
    return Refusal{"arc-too-short", "theta of loop " + std::to_string(number) + " is " + text(degrees(steps->theta)) +
                                        " degrees, less than 15: turn 30 to 45 to either side"};
  }
  return *steps;
}

// Steps 3 to 5 gone through: where the zero of C went, loop by loop, and the readings of the last loop.
struct Settled {
  std::vector<double> zeros;  // of each loop, in the count of the first; rad
  RimSteps steps;
};

Outcome<Settled, Refusal> settle(const std::vector<Loop>& loops, double level_limit) {
  Settled settled;
  double zero = 0.0;
  for (std::size_t k = 0; k < loops.size(); ++k) {
    const bool last = k + 1 == loops.size();
    TRY(const auto steps, stepsOf(loops[k], k + 1, last));
    settled.zeros.push_back(zero);
    settled.steps = steps;
    const double unlevel = std::abs(steps.plus.y() - steps.minus.y());
    if (last && unlevel >= level_limit) {
      return Refusal{"not-level", "the last loop's readings at +theta and -theta differ by " + text(unlevel) +
                                      " mm in y, not less than level_limit_mm: shift the zero of C and read once more"};
    }
    if (unlevel >= level_limit) zero += remainingShift(steps.plus, steps.minus);
  }
  return settled;
}

// Covariance of centre and radius of the steps: differences of (B26), (B27) in each coordinate of each reading, which
// the noise of C moves along the rim. The stylus' offset is left out.
Eigen::Matrix3d covarianceOf(const RimSteps& steps, const RimCentre& centre, const RotationNoise& noise) {
  constexpr double kStep = 1e-3;  // mm
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (Vector2d RimSteps::*reading : {&RimSteps::plus, &RimSteps::minus, &RimSteps::zero}) {
    Eigen::Matrix<double, 3, 2> slopes;
    for (Eigen::Index k = 0; k < 2; ++k) {
      RimSteps up = steps;
      RimSteps down = steps;
      (up.*reading)[k] += kStep;
      (down.*reading)[k] -= kStep;
      const auto above = turnedRimCentre(up);
      const auto below = turnedRimCentre(down);
      if (!above || !below) continue;
      slopes.col(k) << (above->centre - below->centre) / (2.0 * kStep), (above->radius - below->radius) / (2.0 * kStep);
    }
    const Vector2d arm = steps.*reading - centre.centre;
    const Vector2d along{-arm.y(), arm.x()};
    const Eigen::Matrix2d of_reading = noise.position * noise.position * Eigen::Matrix2d::Identity() +
                                       noise.angle * noise.angle * along * along.transpose();
    covariance += slopes * of_reading * slopes.transpose();
  }
  return covariance;
}

// The radius from the reading at +theta and from that at -theta, and the steps against the fit.
std::optional<std::string> disagreement(const RimSteps& steps, const RimCentre& found, const Vector2d& fitted,
                                        const Eigen::Vector3d& sd) {
  RimSteps other = steps;
  std::swap(other.plus, other.minus);
  const auto mirrored = turnedRimCentre(other);
  if (mirrored && std::abs(mirrored->radius - found.radius) > kDisagree * 2.0 * sd[2]) {
    return "the readings at +theta and -theta give radii that differ by " +
           text(std::abs(mirrored->radius - found.radius)) + " mm";
  }
  const Vector2d off = found.centre - fitted;
  for (Eigen::Index k = 0; k < 2; ++k) {
    if (std::abs(off[k]) > kDisagree * sd[k]) {
      return "the steps put the centre " + text(std::abs(off[k])) + " mm from the fit of all readings in " +
             std::string(1, "xy"[k]) + ", more than 4 sd";
    }
  }
  return std::nullopt;
}

// Result of step 2: the zero of C that puts the ball on the nominal line, and its sd if that of a contact is stated.
struct ContactShift {
  double rad{};
  std::optional<double> sd;
};

Outcome<ContactShift, Refusal> contactShift(const Dataset& dataset) {
  if (!dataset.table("contacts")) return ContactShift{};
  TRY(const auto sigma, configSigma(dataset, "sigma_contact_rad"));
  TRY(const auto table, checkedTable(dataset, "contacts", column::kContacts));
  Dataset alone{.method = std::string{kCZeroShift.name}, .config = {}, .tables = {*table}};
  if (sigma.stated) alone.config["sigma_C_rad"] = sigma.value;
  TRY(const auto solved, solveCZeroShift(alone));
  const auto& shift = *solved.find(quantity::kCShift);
  return ContactShift{shift.value(), sigma.stated ? std::optional{shift.sd.front()} : std::nullopt};
}

// Content of a case, read and checked.
struct Measured {
  StatedNoise noise;
  bool trust{true};  // the angles of C
  StylusOffset stylus;
  ContactShift contact;
  std::vector<Loop> loops;
  Settled settled;
};

Outcome<Measured, Refusal> measuredOf(const Dataset& dataset) {
  TRY(const auto noise, statedNoise(dataset));
  TRY(const auto level_limit, configPositive(dataset, "level_limit_mm"));
  TRY(const auto trusted, configSwitch(dataset, "trust_C_angles"));
  const bool trust = trusted || !dataset.config.contains("trust_C_angles");
  const Table* offered = dataset.table("readings");
  const std::span columns{kColumns};
  const bool heights = offered && offered->column(column::kZ);
  TRY(const auto table, checkedTable(dataset, "readings", heights ? columns : columns.first(4)));
  TRY(const auto stylus, stylusOffset(dataset));
  TRY(const auto contact, contactShift(dataset));
  TRY(auto loops, loopsOf(*table, stylus.offset.head<2>()));
  TRY(const auto settled, settle(loops, level_limit.value_or(kUsualLevelLimit_mm)));
  return Measured{noise, trust, stylus, contact, std::move(loops), settled};
}

// All readings with their known angles; the stylus' offset goes into the centre one to one.
Outcome<Fit, Refusal> fitOf(const Measured& measured) {
  std::vector<RotationReading> readings;
  for (std::size_t k = 0; k < measured.loops.size(); ++k) {
    for (const auto& reading : measured.loops[k]) {
      readings.push_back({reading.at, -(reading.c + measured.settled.zeros[k])});
    }
  }
  auto fit = fitRotation(readings, measured.noise.noise);
  if (!fit) return fit;
  fit->cofactor.diagonal().head<2>() += measured.stylus.variance.head<2>() * std::pow(measured.noise.noise.position, 2);
  return fit;
}

// Read minus fitted, in the order of the loops.
Residuals residualsOf(const Measured& measured, const Fit& fit) {
  const RotationNoise& noise = measured.noise.noise;
  Residuals residuals{.unit = "mm", .against = std::string{kColumns[1]}, .names = {}, .at = {}, .values = {}};
  for (std::size_t loop = 0; loop < measured.loops.size(); ++loop) {
    for (const auto& reading : measured.loops[loop]) {
      for (const auto part : residualParts(noise)) {
        const double left = fit.residuals[static_cast<Eigen::Index>(residuals.values.size())];
        residuals.names.push_back("loop " + std::to_string(loop + 1) + ", C " + text(reading.c) + " rad, " +
                                  std::string{part});
        residuals.at.push_back(reading.c);
        residuals.values.push_back(residualSense(noise) * noise.position * left);
      }
    }
  }
  return residuals;
}

Result resultOfFit(const Dataset& dataset, const Measured& measured, const Fit& fit) {
  const Vector2d arm = fit.parameters.tail<2>();
  Answer answer{dataset, fit, {measured.noise.noise.position, measured.noise.stated}};
  answer.result().residuals = residualsOf(measured, fit);
  answer.promiseVector(quantity::kCentre, fit.parameters.head<2>(), pick(0, 2, 4));
  answer.promiseScalar(quantity::kRadius, arm.norm(), Eigen::RowVector4d{0.0, 0.0, arm.x(), arm.y()} / arm.norm());
  return std::move(answer).take(true);
}

// Nothing of the fit, whose angles are not to be trusted. What is left of the steps is how far their readings lie off
// their circle; six coordinates tell centre, radius, psi and theta.
Result resultOfSteps(const Dataset& dataset, const Measured& measured, const RimCentre& found,
                     const Eigen::Matrix3d& covariance) {
  const RimSteps& steps = measured.settled.steps;
  const bool stated = measured.noise.stated;
  const Eigen::Vector3d sd = covariance.diagonal().cwiseSqrt();
  Result result;
  result.method = dataset.method;
  result.estimates = {Estimate::vector(quantity::kCentre, {found.centre.x(), found.centre.y()},
                                       stated ? std::vector{sd[0], sd[1]} : std::vector<double>{}),
                      Estimate::scalar(quantity::kRadius, found.radius, stated ? std::optional{sd[2]} : std::nullopt)};
  result.residuals = {
      .unit = "mm", .against = "reading", .names = {"+theta", "-theta", "zero"}, .at = {}, .values = {}};
  double squares = 0.0;
  for (const Vector2d& at : {steps.plus, steps.minus, steps.zero}) {
    const double off = (at - found.centre).norm() - found.radius;
    squares += off * off;
    result.residuals.at.push_back(static_cast<double>(result.residuals.at.size() + 1));
    result.residuals.values.push_back(off);
  }
  result.rms = std::sqrt(squares / 3.0);
  result.dof = 1;
  result.condition = scaledCondition(inverse(covariance));  // of a Jacobian that would have this covariance
  if (stated) {
    const auto entries = covariance.reshaped();
    const std::string centre{quantity::kCentre};
    result.covariance =
        Covariance{{centre + "[0]", centre + "[1]", std::string{quantity::kRadius}}, {entries.begin(), entries.end()}};
  } else {
    result.warnings.emplace_back("no sd: the uncertainty of the steps needs sigma_mm, which is not stated");
  }
  return result;
}

// The stylus' offset, and how high the ball runs where that was read: what z tells, the offset taken off.
void addStylus(std::vector<Estimate>& also, const Table& readings, const StylusOffset& stylus,
               const StatedNoise& noise) {
  const double sigma = noise.noise.position;
  const Vector3d sd = sigma * stylus.variance.cwiseSqrt();
  const std::size_t parts = stylus.flat ? 2 : 3;
  std::vector<double> sds;
  if (noise.stated) sds.assign(sd.data(), sd.data() + parts);
  also.push_back(Estimate::vector(quantity::kStylusOffset, {stylus.offset.data(), stylus.offset.data() + parts}, sds));
  const auto* heights = readings.column(column::kZ);
  if (heights == nullptr) return;
  const auto count = static_cast<double>(heights->size());
  const double mean = std::accumulate(heights->begin(), heights->end(), 0.0) / count;
  const double height_sd = sigma * std::sqrt(1.0 / count + stylus.variance.z());
  also.push_back(
      Estimate::scalar("height_mm", mean + stylus.offset.z(), noise.stated ? std::optional{height_sd} : std::nullopt));
}

}  // namespace

Outcome<Result, Refusal> solveCentrelineBySteps(const Dataset& dataset) {
  if (auto refusal = refuseSpindle(dataset)) return *refusal;
  TRY(const auto read, measuredOf(dataset));
  const Measured& measured = read;
  const RimSteps& steps = measured.settled.steps;
  const auto plain = rimCentre(steps.plus, steps.minus, steps.zero);
  const auto found = turnedRimCentre(steps);
  if (!plain || !found) {
    return Refusal{"level-readings",
                   "the readings at 0 and at theta have the same height and do not determine the radius: turn further"};
  }
  TRY(const auto fit, fitOf(measured));
  const Vector2d fitted = fit.parameters.head<2>();
  const RotationNoise& noise = measured.noise.noise;
  Eigen::Matrix3d covariance = covarianceOf(steps, *found, noise);
  // The stylus' offset is the same in both.
  const auto differ =
      measured.noise.stated ? disagreement(steps, *found, fitted, covariance.diagonal().cwiseSqrt()) : std::nullopt;
  if (differ && measured.trust) {
    return Refusal{
        "steps-disagree",
        *differ + ": check the angles of C; if they are wrong, set trust_C_angles to false, and the steps decide"};
  }
  covariance.diagonal().head<2>() += measured.stylus.variance.head<2>() * noise.position * noise.position;

  Result result =
      measured.trust ? resultOfFit(dataset, measured, fit) : resultOfSteps(dataset, measured, *found, covariance);
  auto& warnings = result.warnings;
  if (differ) warnings.push_back(*differ + "; the angles of C are not trusted, so the steps count");
  if (!measured.noise.stated) warnings.emplace_back("the steps are not compared with the fit: that needs sigma_mm");
  result.convention = "C clockwise from +Y";
  auto& also = result.also;
  also.push_back(Estimate::vector("fit_centre_mm", {fitted.x(), fitted.y()}, {}));
  also.push_back(Estimate::vector("steps_centre_mm", {plain->centre.x(), plain->centre.y()}, {}));
  also.push_back(Estimate::scalar("steps_radius_mm", plain->radius, std::nullopt));
  also.push_back(
      Estimate::scalar(quantity::kCShift, measured.contact.rad + measured.settled.zeros.back(), std::nullopt));
  if (dataset.table("contacts") != nullptr)
    also.push_back(Estimate::scalar("contact_shift_rad", measured.contact.rad, measured.contact.sd));
  addStylus(also, *dataset.table("readings"), measured.stylus, measured.noise);
  if (auto refusal = addMeanHeight(dataset, result)) return *refusal;
  return result;
}

namespace {

constexpr MethodTable kRimStepsTables[]{
    {"readings", kColumns, "the ball at an angle of C from the zero in force in that loop; z_mm too where wanted",
     true},
    {"stylus", kStylusColumns,
     "optional: tip of the stylus with the spindle at 0 and 180 degrees; of x_mm, y_mm, z_mm give the two across the "
     "spindle",
     true},
    {"contacts", column::kContacts, "optional: angles of C at which the ball touches the stylus on either side", true}};
constexpr MethodKey kRimStepsKeys[]{
    key::kSigma,
    key::kSigmaC,
    key::kSpindle,
    MethodKey{"sigma_contact_rad", "", "sd of an angle of C at a contact (k = 1), for the sd of contact_shift_rad"}
        .upTo(quantity::kMostLean_rad),
    {"level_limit_mm", "0.01", "largest difference of y at +theta and -theta that counts as level"},
    {"trust_C_angles", "true", "false if the angles of C are wrong: the result then follows from the steps"},
    key::kMeanHeight,
    key::kTauForTheRecord};
// Only half a turn of the spindle relates the tip to the spindle axis.
std::optional<Subject> subjectOfSteps(const Dataset& dataset) {
  return subjectOfSpindle(dataset,
                          dataset.table("stylus") != nullptr ? SubjectKind::centreline : SubjectKind::centreline_tip);
}

constexpr Quantity kRimStepsResults[]{quantity::kCentre.as("centre of rotation, x y"), quantity::kRadius};

}  // namespace

const Method kCentrelineBySteps{.name = "centreline-by-steps",
                                .title = "Centreline with limited access, step by step",
                                .equations = "(B8), (B11), (B25)-(B27), (B33)",
                                .source = source::kMachine,
                                .solver = solveCentrelineBySteps,
                                .tables = kRimStepsTables,
                                .keys = kRimStepsKeys,
                                .results = kRimStepsResults,
                                .unobservable = kCentrelineUnobservable,
                                .subject = {.about = Subject{SubjectKind::centreline}, .of = subjectOfSteps}};

}  // namespace probebox::metrology
