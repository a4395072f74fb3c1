#include "firmware/metrology/centreline/centreline.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/rigid_motion.hpp"
#include "firmware/metrology/fit/shared_errors.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr MethodColumn kCentrelineColumns[]{column::kC, column::kX, column::kY};
// The readings have been corrected by the previous delay; it stands in the case for the record.
constexpr double kFarthestMean = 0.999;  // |w|^2 of three and more angles
constexpr double kLeastHalfSine = 0.05;  // |sin(alpha/2)| of two
constexpr double kWarnHalfSine = 0.25;

// 1 - |w|^2: how much of the information about the centre the angles leave; sin^2(alpha/2) for two.
double spread(std::span<const RotationReading> readings) {
  std::complex<double> mean;
  for (const auto& reading : readings) mean += std::polar(1.0, reading.angle) / static_cast<double>(readings.size());
  return 1.0 - std::norm(mean);
}

std::optional<Refusal> badAngles(std::span<const RotationReading> readings) {
  if (readings.size() < 2) {
    return Refusal{"too-few-readings",
                   "one reading does not determine the centre: read the feature at two or more angles"};
  }
  const double least = readings.size() == 2 ? kLeastHalfSine * kLeastHalfSine : 1.0 - kFarthestMean;
  if (spread(readings) >= least) return std::nullopt;
  return Refusal{"angles-too-close", std::string{readings.size() == 2 ? "the two readings are" : "all readings are"} +
                                         " at the same angle, or nearly: turn the axis further between readings, best "
                                         "by 180 degrees"};
}

// The angle error of a stop that fits its readings best beside their own sigma, for a centre and an arm.
double angleError(std::span<const RotationReading> of_stop, const Eigen::Vector2d& centre, const Eigen::Vector2d& arm,
                  const RotationNoise& noise) {
  const double weight = std::pow(noise.position / noise.angle, 2);
  double error = 0.0;
  for (int step = 0; step < 8; ++step) {  // Newton on sum |p - c - R r|^2 / sigma^2 + error^2 / sigma_angle^2
    double slope = weight * error, curvature = weight, least = 0.0;
    for (const auto& reading : of_stop) {
      const Eigen::Vector2d turned = turn(reading.angle + error) * arm;
      const Eigen::Vector2d tangent{-turned.y(), turned.x()};
      const Eigen::Vector2d off = reading.at - centre;
      slope -= tangent.dot(off);
      curvature += turned.dot(off);
      least += 0.5 * turned.squaredNorm();
    }
    const double change = slope / std::max(curvature, least);
    error -= change;
    if (std::abs(change) < 1e-15) break;
  }
  return error;
}

// The angle error of each reading: one a stop.
std::vector<double> angleErrors(std::span<const RotationReading> readings, std::span<const double> stops,
                                const Eigen::Vector2d& centre, const Eigen::Vector2d& arm, const RotationNoise& noise) {
  std::vector<double> errors;
  for (std::size_t first = 0, next = 0; first < readings.size(); first = next) {
    while (next < readings.size() && stops[next] == stops[first]) ++next;
    errors.resize(next, angleError(readings.subspan(first, next - first), centre, arm, noise));
  }
  return errors;
}

// Rows of one reading: along its arm, and across it, where the noise of the angle adds to that of the position and is
// common to the readings of a stop. The angle errors are at their best for these parameters, so the derivatives need
// not follow them.
Linearised rotationModel(std::span<const RotationReading> readings, std::span<const double> stops,
                         const RotationNoise& noise, const Eigen::VectorXd& parameters) {
  const Eigen::Vector2d centre = parameters.head<2>();
  const Eigen::Vector2d arm = parameters.tail<2>();
  const auto rows = static_cast<Eigen::Index>(2 * readings.size());
  Linearised model{Eigen::VectorXd{rows}, Eigen::MatrixXd{rows, 4}};
  Eigen::VectorXd moved = Eigen::VectorXd::Zero(rows);  // by one sd of the stop, in sigma
  std::vector<double> stop_of_row;
  const auto errors = angleErrors(readings, stops, centre, arm, noise);
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto& reading = readings[k];
    const auto row = static_cast<Eigen::Index>(2 * k);
    const Eigen::Matrix2d turned = turn(reading.angle + errors[k]);
    const Eigen::Vector2d along = (turned * arm).normalized();
    const Eigen::Vector2d across{-along.y(), along.x()};
    const Eigen::Vector2d left = reading.at - centre - turned * arm;
    model.residuals[row] = along.dot(left);
    model.residuals[row + 1] = across.dot(left) + arm.norm() * errors[k];
    model.jacobian.row(row) << -along.transpose(), -along.transpose() * turned;
    model.jacobian.row(row + 1) << -across.transpose(), -across.transpose() * turned;
    moved[row + 1] = arm.norm() * noise.angle / noise.position;
    stop_of_row.insert(stop_of_row.end(), 2, stops[k]);
  }
  model.residuals /= noise.position;
  model.jacobian /= noise.position;
  shareErrors(model.jacobian, model.residuals, moved, stop_of_row);
  return model;
}

}  // namespace

Outcome<Fit, Refusal> fitRotation(std::span<const RotationReading> readings, const RotationNoise& noise) {
  if (auto refusal = badAngles(readings)) return *refusal;
  const auto rows = static_cast<Eigen::Index>(2 * readings.size());
  Eigen::MatrixXd design{rows, 4};
  Eigen::VectorXd values{rows};
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(2 * k);
    design.block<2, 4>(row, 0) << Eigen::Matrix2d::Identity(), turn(readings[k].angle);
    values.segment<2>(row) = readings[k].at;
  }
  auto linear = linearLeastSquares(design / noise.position, values / noise.position);
  if (!linear || noise.angle <= 0.0) return linear;
  std::vector<double> angles;
  for (const auto& reading : readings) angles.push_back(reading.angle);
  const auto stops = stopsByAngle(angles);
  return leastSquares([&](const Eigen::VectorXd& at) { return rotationModel(readings, stops, noise, at); },
                      linear->parameters);
}

std::vector<double> stopsByAngle(std::span<const double> angles_rad) {
  std::vector<double> stops;
  for (std::size_t k = 0; k < angles_rad.size(); ++k) {
    const bool turned = k > 0 && std::abs(std::remainder(angles_rad[k] - angles_rad[k - 1], kTurn)) > kSameStop_rad;
    stops.push_back(k == 0 ? 0.0 : stops.back() + (turned ? 1 : 0));
  }
  return stops;
}

std::optional<Refusal> addMeanHeight(const Dataset& dataset, Result& result) {
  TRY(const auto height_mm, configNumber(dataset, "mean_z_mm"));
  if (height_mm) result.also.push_back(Estimate::scalar(quantity::kMeanHeight, *height_mm, std::nullopt));
  return std::nullopt;
}

std::span<const std::string_view> residualParts(const RotationNoise& noise) {
  static constexpr std::array<std::string_view, 2> kPlain{column::kX, column::kY};
  static constexpr std::array<std::string_view, 2> kByArm{"along the arm", "across the arm, scaled to sigma_mm"};
  return noise.angle > 0.0 ? kByArm : kPlain;
}

double residualSense(const RotationNoise& noise) {
  return noise.angle > 0.0 ? 1.0 : -1.0;
}

std::optional<Refusal> refuseStylusOff(double off_mm, std::string_view where, std::string_view remedy) {
  constexpr double kMostOffset_mm = 10.0;
  if (off_mm <= kMostOffset_mm) return std::nullopt;
  return Refusal{"implausible", std::string{where} + ": the stylus is " + text(off_mm) +
                                    " mm off the spindle axis, more than 10: check " + std::string{remedy}};
}

Outcome<StatedNoise, Refusal> statedNoise(const Dataset& dataset) {
  TRY(const auto position, configSigma(dataset, "sigma_mm"));
  TRY(const auto angle, configSigma(dataset, "sigma_C_rad"));
  const bool both = position.stated && angle.stated;
  StatedNoise noise{.noise = {position.value, both ? angle.value : 0.0}, .stated = position.stated, .warnings = {}};
  if (angle.stated && !position.stated) noise.warnings.emplace_back("sigma_C_rad is not used: it also needs sigma_mm");
  return noise;
}

Subject subjectOfSpindle(const Dataset& dataset, SubjectKind kind) {
  const auto spindle = configNumber(dataset, key::kSpindle.name);
  const bool is_second = spindle && *spindle && **spindle == kSecondSpindle;
  return {kind, is_second ? kSecondSpindle : 0};
}

std::optional<Subject> subjectOfCentreline(const Dataset& dataset) {
  return subjectOfSpindle(dataset, SubjectKind::centreline_tip);
}

std::optional<Refusal> refuseSpindle(const Dataset& dataset) {
  const auto spindle = configNumber(dataset, key::kSpindle.name);
  if (!spindle) return spindle.error();
  if (!*spindle || **spindle == 1 || **spindle == kSecondSpindle) return std::nullopt;
  return Refusal{"bad-config",
                 "config key 'spindle' is " + text(**spindle) + ": give 1 for the main chuck or 2 for the second one"};
}

Outcome<Result, Refusal> solveCentreline(const Dataset& dataset) {
  if (auto refusal = refuseSpindle(dataset)) return *refusal;
  TRY(const auto noise, statedNoise(dataset));
  TRY(const auto sense, configSense(dataset, "C_sense"));
  TRY(const auto table, checkedTable(dataset, "readings", kCentrelineColumns));
  const auto value = [&](std::size_t column, std::size_t row) {
    return (*table->column(kCentrelineColumns[column]))[row];
  };
  std::vector<RotationReading> readings;
  for (std::size_t row = 0; row < table->rows(); ++row) {
    readings.push_back({.at = {value(1, row), value(2, row)}, .angle = sense * value(0, row)});
  }
  TRY(const auto fit, fitRotation(readings, noise.noise));

  Answer answer{dataset, fit, noise.sigma()};
  answer.readings(*table, residualParts(noise.noise), column::kC, residualSense(noise.noise));
  answer.promiseVector(quantity::kCentre, fit.parameters.head(2), pick(0, 2, 4));
  answer.alsoVector("arm_mm", fit.parameters.tail(2), pick(2, 2, 4));
  if (spread(readings) < kWarnHalfSine * kWarnHalfSine) {
    answer.warn("the angles lie close together: the centre is more than four times less certain than a reading");
  }
  if (noise.stated && fit.parameters.tail<2>().norm() < 5.0 * noise.noise.position) {
    answer.warn("the feature lies within 5 sigma of the centre: the readings cannot confirm the angles");
  }
  for (const auto& warning : noise.warnings) answer.warn(warning);
  for (auto& warning : equalRows(*table)) answer.warn(std::move(warning));
  if (auto refusal = addMeanHeight(dataset, answer.result())) return *refusal;
  return std::move(answer).take(true);
}

namespace {

constexpr MethodTable kCentrelineTables[]{
    {"readings", kCentrelineColumns, "a feature that turns with C, at an angle of C", true}};
constexpr MethodKey kCentrelineKeys[]{key::kSigma,   key::kSigmaC,     key::kCSense,
                                      key::kSpindle, key::kMeanHeight, key::kTauForTheRecord};
constexpr Quantity kCentrelineResults[]{quantity::kCentre.as("centre of rotation, x y")};

}  // namespace

const std::string_view kCentrelineUnobservable[2]{
    "first harmonics of EXC and EYC separately from the position of the axis, XOC and YOC",
    "the direction of the axis: the readings are at one height"};

const Method kCentreline{.name = "centreline",
                         .title = "Centreline of the part's spindle",
                         .equations = "(B5)-(B8)",
                         .source = source::kMachine,
                         .solver = solveCentreline,
                         .tables = kCentrelineTables,
                         .keys = kCentrelineKeys,
                         .results = kCentrelineResults,
                         .unobservable = kCentrelineUnobservable,
                         .subject = {.about = Subject{SubjectKind::centreline_tip}, .of = subjectOfCentreline}};

}  // namespace probebox::metrology
