#include "firmware/metrology/centreline/limited_access.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/centreline/ball_readings.hpp"
#include "firmware/metrology/centreline/centreline.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/fit/angular_span.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/rigid_motion.hpp"
#include "firmware/metrology/fit/rounded_means.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr Quantity kPsiAtZero{.key = "psi0_rad", .about = "where the ball stands at C = 0, clockwise from +Y"};

constexpr MethodColumn kLimitedAccessColumns[]{column::kCClockwise, column::kX, column::kY};
constexpr double kMostApart_rad = kTurn / 3.0;  // contacts on either side of a stylus (chosen)
constexpr double kLeastStep_rad = 1e-9;         // a whole turn on or off leaves less (chosen)

// The readings that the source's steps need, those with the largest theta.
std::optional<RimSteps> sourceReadings(const std::vector<RimReading>& readings) {
  const auto steps = rimStepsOf(readings);
  if (!steps || !steps->zero_read || steps->theta < kLeastHalfArc_rad) return std::nullopt;
  return steps;
}

// (B5) for two readings, C clockwise.
Eigen::Vector2d centreBetween(const RimReading& plus, const RimReading& minus) {
  const Eigen::Vector2d chord = minus.at - plus.at;
  return (plus.at + minus.at) / 2.0 +
         Eigen::Vector2d{-chord.y(), chord.x()} / (2.0 * std::tan((plus.c - minus.c) / 2.0));
}

void compareWithSource(Answer& answer, const std::vector<RimReading>& readings, const Eigen::Vector2d& centre,
                       const StatedNoise& noise) {
  const auto source = sourceReadings(readings);
  const auto found = source ? turnedRimCentre(*source) : std::nullopt;
  if (!found) return;
  auto& also = answer.result().also;
  also.push_back(Estimate::vector("source_centre_mm", {found->centre.x(), found->centre.y()}, {}));
  if (!noise.stated) return;
  const double theta = source->theta;
  const double sigma = std::hypot(noise.noise.position, found->radius * noise.noise.angle);
  const double sd = sigma * std::sqrt(2.0 + std::pow(std::sin(theta), 2)) / (1.0 - std::cos(theta));
  const double off = (found->centre - centre).norm();
  if (off > 4.0 * sd) {
    answer.warn("the source's three readings put the centre " + text(off) +
                " mm away, more than 4 sd: check the angles of C, and that the ball has not moved");
  }
}

// The middle of each pair of contacts, in the turn of the first.
Outcome<Eigen::VectorXd, Refusal> middlesOf(const std::vector<double>& clockwise,
                                            const std::vector<double>& anticlockwise) {
  Eigen::VectorXd middles{static_cast<Eigen::Index>(clockwise.size())};
  for (std::size_t row = 0; row < clockwise.size(); ++row) {
    const double apart = std::remainder(anticlockwise[row] - clockwise[row], kTurn);
    const std::string where = "table 'contacts', row " + std::to_string(row + 1) + ": ";
    if (std::abs(apart) <= kSameAngle_rad) {
      return Refusal{"not-opposite", where + "both contacts are at one angle; touch the stylus from either side"};
    }
    if (std::abs(apart) > kMostApart_rad) {
      return Refusal{"not-opposite", where + "the contacts are " + text(degrees(std::abs(apart))) +
                                         " degrees apart; touch one stylus from either side, and give both angles in "
                                         "radians"};
    }
    const double middle = clockwise[row] + apart / 2.0;
    auto& placed = middles[static_cast<Eigen::Index>(row)];
    placed = row == 0 ? middle : middles[0] + std::remainder(middle - middles[0], kTurn);
  }
  return middles;
}

// Smallest difference of two angles of one side, which is the step of C where its display hides the noise, and the
// scatter of a contact: by the middles too, which may agree by chance where contacts do not.
struct ContactSteps {
  std::optional<double> step;  // rad; nothing where all are equal
  double scatter{};            // rad
};

ContactSteps contactSteps(const std::vector<double>& clockwise, const std::vector<double>& anticlockwise,
                          double scatter_of_middle) {
  ContactSteps steps;
  double squares = 0.0;
  for (const auto* side : {&clockwise, &anticlockwise}) {
    std::vector<double> off;  // the first
    for (const double angle : *side) off.push_back(std::remainder(angle - side->front(), kTurn));
    const auto all = Eigen::VectorXd::Map(off.data(), static_cast<Eigen::Index>(off.size()));
    squares += (all.array() - all.mean()).square().sum();
    std::ranges::sort(off);
    for (std::size_t k = 1; k < off.size(); ++k) {
      const double step = off[k] - off[k - 1];
      if (step > kLeastStep_rad) steps.step = std::min(step, steps.step.value_or(step));
    }
  }
  const double by_contacts = std::sqrt(squares / (2.0 * static_cast<double>(clockwise.size() - 1)));
  steps.scatter = std::min(by_contacts, std::numbers::sqrt2 * scatter_of_middle);
  return steps;
}

// Adds to the sd what the steps of C leave of the mean of its contacts. No sd where all are equal: digits of angles in
// radians do not show the step.
void addSteps(Result& result, const ContactSteps& steps) {
  constexpr double kCounts = 0.1;  // of the scatter of a contact
  if (!steps.step) {
    for (auto& estimate : result.estimates) estimate.sd.clear();
    result.covariance.reset();
    result.warnings.emplace_back(
        "no sd: no sigma is stated and all contacts of a side are at the same angle, as the digits of C hide their "
        "noise; state sigma_C_rad, or read more digits");
    return;
  }
  const double sd = roundingSd(steps.scatter, *steps.step);  // of either side
  widen(result, Eigen::RowVector2d{0.5, 0.5}, Eigen::Vector2d::Constant(sd));
  if (sd <= kCounts * steps.scatter) return;
  result.warnings.push_back("C is read in steps of " + text(*steps.step) +
                            " rad, which hide the noise of a contact: what rounding leaves of their mean, " +
                            text(sd / std::numbers::sqrt2) +
                            " rad, is in the sd; state sigma_C_rad, or read more digits");
}

}  // namespace

std::optional<RimSteps> rimStepsOf(std::span<const RimReading> readings) {
  if (readings.empty()) return std::nullopt;
  std::vector<RimReading> within{readings.begin(), readings.end()};  // half a turn of zero
  for (auto& reading : within) reading.c = std::remainder(reading.c, kTurn);
  const auto nearest = [&](double angle) {
    return *std::ranges::min_element(within, {}, [&](const RimReading& r) { return std::abs(r.c - angle); });
  };
  const RimReading plus = *std::ranges::max_element(within, {}, &RimReading::c);
  const double theta = plus.c;
  const RimReading minus = nearest(-theta);
  const RimReading zero = nearest(0.0);
  if (std::abs(minus.c + theta) > kSameStop_rad) return std::nullopt;
  RimSteps steps{.plus = plus.at,
                 .minus = minus.at,
                 .zero = {0.0, 0.0},
                 .theta = theta,
                 .zero_read = std::abs(zero.c) <= kPoseTolerance_rad};
  if (steps.zero_read) steps.zero = zero.at;
  if (theta < kLeastHalfArc_rad) return steps;  // locates no centre
  const Eigen::Vector2d centre = centreBetween(plus, minus);
  const auto turned = [&](const RimReading& reading, double nominal) -> Eigen::Vector2d {
    return centre + turn(reading.c - nominal) * (reading.at - centre);
  };
  if (minus.c != -theta) steps.minus = turned(minus, -theta);
  if (steps.zero_read && zero.c != 0.0) steps.zero = turned(zero, 0.0);
  return steps;
}

double remainingShift(const Eigen::Vector2d& at_plus, const Eigen::Vector2d& at_minus) {
  return std::atan((at_plus.y() - at_minus.y()) / (at_plus.x() - at_minus.x()));
}

std::optional<RimCentre> rimCentre(const Eigen::Vector2d& at_plus, const Eigen::Vector2d& at_minus,
                                   const Eigen::Vector2d& at_zero) {
  const double drop = at_zero.y() - at_plus.y();
  if (drop == 0.0) return std::nullopt;
  const double radius = (at_plus - at_zero).squaredNorm() / (2.0 * drop);
  return RimCentre{{(at_plus.x() + at_minus.x()) / 2.0, at_zero.y() - radius}, radius};
}

std::optional<RimCentre> turnedRimCentre(const RimSteps& steps) {
  const double phi = remainingShift(steps.plus, steps.minus);
  const Eigen::Matrix2d back = turn(-phi);
  auto found = rimCentre(back * steps.plus, back * steps.minus, back * steps.zero);
  if (found) found->centre = turn(phi) * found->centre;
  return found;
}

Outcome<Result, Refusal> solveCentrelineLimitedAccess(const Dataset& dataset) {
  if (auto refusal = refuseSpindle(dataset)) return *refusal;
  TRY(const auto noise, statedNoise(dataset));
  TRY(const auto table, checkedTable(dataset, "readings", kLimitedAccessColumns));
  const auto value = [&](std::size_t column, std::size_t row) {
    return (*table->column(kLimitedAccessColumns[column]))[row];
  };
  std::vector<RimReading> rim;
  std::vector<RotationReading> readings;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    rim.push_back({.at = {value(1, row), value(2, row)}, .c = value(0, row)});
    readings.push_back({.at = rim.back().at, .angle = -rim.back().c});
  }
  const double arc = angularSpan(*table->column(kLimitedAccessColumns[0]), kTurn);
  if (arc < 2.0 * kLeastHalfArc_rad - kSameAngle_rad) {
    return Refusal{"arc-too-short",
                   "C spans " + text(degrees(arc)) + " degrees, less than 30: turn 15 degrees or more to either side"};
  }
  TRY(const auto fit, fitRotation(readings, noise.noise));

  const Eigen::Vector2d arm = fit.parameters.tail<2>();
  const double radius = arm.norm();
  Answer answer{dataset, fit, noise.sigma()};
  answer.readings(*table, residualParts(noise.noise), kLimitedAccessColumns[0], residualSense(noise.noise));
  answer.promiseVector(quantity::kCentre, fit.parameters.head(2), pick(0, 2, 4));
  answer.promiseScalar(quantity::kRadius, radius, Eigen::RowVector4d{0.0, 0.0, arm.x(), arm.y()} / radius);
  answer.promiseScalar(kPsiAtZero, std::atan2(arm.x(), arm.y()),
                       Eigen::RowVector4d{0.0, 0.0, arm.y(), -arm.x()} / (radius * radius));
  compareWithSource(answer, rim, fit.parameters.head<2>(), noise);
  for (const auto& warning : noise.warnings) answer.warn(warning);
  for (auto& warning : equalRows(*table)) answer.warn(std::move(warning));
  answer.result().convention = "C clockwise from +Y; psi0 is the angle of the ball at C = 0";
  if (auto refusal = addMeanHeight(dataset, answer.result())) return *refusal;
  return std::move(answer).take(true);
}

Outcome<Result, Refusal> solveCZeroShift(const Dataset& dataset) {
  TRY(const auto sigma, configSigma(dataset, "sigma_C_rad"));
  TRY(const auto table, checkedTable(dataset, "contacts", column::kContacts));
  const auto& clockwise = *table->column(column::kContacts[0]);
  const auto& anticlockwise = *table->column(column::kContacts[1]);
  TRY(const auto middles, middlesOf(clockwise, anticlockwise));
  const Sigma of_middle{sigma.stated ? sigma.value / std::numbers::sqrt2 : 1.0, sigma.stated};
  const auto fit = linearLeastSquares(Eigen::MatrixXd::Constant(middles.size(), 1, 1.0 / of_middle.value),
                                      middles / of_middle.value);
  if (!fit) return fit.error();
  Answer answer{dataset, fit.value(), of_middle};
  answer.readingIs("the middle of one pair of contacts", "rad");
  answer.readings(*table, {"middle"}, column::kContacts[0]);
  answer.promiseScalar(quantity::kCShift, fit->parameters[0], pick(0, 1, 1).row(0));
  answer.result().convention = "new zero of C in the old count; rms in rad";
  const double scatter = answer.readingSd().value_or(0.0);
  Result result = std::move(answer).take(true);
  if (!sigma.stated && !result.estimates.front().sd.empty())
    addSteps(result, contactSteps(clockwise, anticlockwise, scatter));
  return result;
}

namespace {

constexpr MethodTable kLimitedAccessTables[]{{"readings", kLimitedAccessColumns, "the ball at an angle of C", true}};
constexpr MethodKey kLimitedAccessKeys[]{key::kSigma, key::kSigmaC, key::kSpindle, key::kMeanHeight,
                                         key::kTauForTheRecord};
constexpr Quantity kLimitedAccessResults[]{quantity::kCentre.as("centre of rotation, x y"), quantity::kRadius,
                                           kPsiAtZero};
constexpr MethodTable kContactTables[]{
    {"contacts", column::kContacts, "signed angles of C at which the ball touches the stylus on either side", true}};
constexpr MethodKey kContactKeys[]{key::kSigmaC};
constexpr Quantity kContactResults[]{quantity::kCShift};
constexpr std::string_view kContactUnobservable[]{
    "the offset of the stylus from the spindle, except for the part that two opposite contacts cancel"};

}  // namespace

const Method kCentrelineLimitedAccess{
    .name = "centreline-limited-access",
    .title = "Centreline with limited access",
    .equations = "(B6)-(B8), (B26), (B27)",
    .source = source::kMachine,
    .solver = solveCentrelineLimitedAccess,
    .tables = kLimitedAccessTables,
    .keys = kLimitedAccessKeys,
    .results = kLimitedAccessResults,
    .unobservable = kCentrelineUnobservable,
    .subject = {.about = Subject{SubjectKind::centreline_tip}, .of = subjectOfCentreline}};

const Method kCZeroShift{.name = "c-zero-shift",
                         .title = "Zero of the C axis",
                         .equations = "(B25)",
                         .source = source::kMachine,
                         .solver = solveCZeroShift,
                         .tables = kContactTables,
                         .keys = kContactKeys,
                         .results = kContactResults,
                         .unobservable = kContactUnobservable};

}  // namespace probebox::metrology
