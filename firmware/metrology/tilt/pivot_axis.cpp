#include "firmware/metrology/tilt/pivot_axis.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/machine_plane.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/tilt/pivot.hpp"
#include "firmware/metrology/tilt/tilt_readings.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr Index kAxis = 4;              // parameters of the axis: pivot, lean
constexpr double kMostLeanPerMm = 0.2;  // rad/mm: a lever of 5 mm

// Coordinates across the axis, then along it from their centre.
Vector3d placeOf(const TiltReading& reading) {
  return {reading.at.x(), reading.at.y(), reading.along};
}

// Parameters: pivot (2), lean (2), then every point at tilt zero (3).
Linearised pivotModel(const std::vector<TiltReading>& readings, double sigma, const VectorXd& at) {
  const auto rows = static_cast<Index>(3 * readings.size());
  Linearised model{VectorXd{rows}, Eigen::MatrixXd::Zero(rows, at.size())};
  const Vector3d pivot{at[0], at[1], 0.0};
  const Vector3d along{at[2], at[3], 1.0};
  const Vector3d u = along.normalized();
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto row = static_cast<Index>(3 * k);
    const Index point = kAxis + static_cast<Index>(3 * readings[k].point);
    const double tilt = readings[k].tilt_deg * kDegree;
    const double sine = std::sin(tilt);
    const double rest = 1.0 - std::cos(tilt);
    const Matrix3d turned = Eigen::AngleAxisd{tilt, u}.toRotationMatrix();
    const Vector3d arm = at.segment<3>(point) - pivot;
    model.residuals.segment<3>(row) = (pivot + turned * arm - placeOf(readings[k])) / sigma;
    model.jacobian.block<3, 2>(row, 0) = (Matrix3d::Identity() - turned).leftCols<2>() / sigma;
    model.jacobian.block<3, 3>(row, point) = turned / sigma;
    for (Index k2 = 0; k2 < 2; ++k2) {  // of the axis' direction
      const Vector3d du = (Vector3d::Unit(k2) - u * u[k2]) / along.norm();
      model.jacobian.block<3, 1>(row, 2 + k2) =
          (du.cross(arm) * sine + (du * u.dot(arm) + u * du.dot(arm)) * rest) / sigma;
    }
  }
  return model;
}

// From the fit in the plane, the axis parallel to its machine axis.
VectorXd startFrom(const Fit& plane, const std::vector<TiltReading>& readings) {
  const Index points = (plane.parameters.size() - 2) / 2;
  VectorXd start = VectorXd::Zero(kAxis + 3 * points);
  start.head<2>() = plane.parameters.head<2>();
  for (Index point = 0; point < points; ++point) {
    start.segment<2>(kAxis + 3 * point) = plane.parameters.head<2>() + plane.parameters.segment<2>(2 + 2 * point);
  }
  for (const auto& reading : readings) start[kAxis + 3 * static_cast<Index>(reading.point) + 2] = reading.along;
  return start;
}

std::optional<Refusal> shortArm(const Fit& fit, const Sigma& sigma) {
  double longest = 0.0;
  for (Index point = kAxis; point < fit.parameters.size(); point += 3) {
    longest = std::max(longest, (fit.parameters.segment<2>(point) - fit.parameters.head<2>()).norm());
  }
  return refuseArm(longest, sigma);
}

// By how much each row moves as its stop turns, in sd of a reading.
VectorXd turningOf(const std::vector<TiltReading>& readings, double sigma, const VectorXd& at) {
  VectorXd per_radian{static_cast<Index>(3 * readings.size())};
  const Vector3d pivot{at[0], at[1], 0.0};
  const Vector3d u = Vector3d{at[2], at[3], 1.0}.normalized();
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const Vector3d arm = at.segment<3>(kAxis + static_cast<Index>(3 * readings[k].point)) - pivot;
    per_radian.segment<3>(static_cast<Index>(3 * k)) =
        u.cross(Eigen::AngleAxisd{readings[k].tilt_deg * kDegree, u} * arm) / sigma;
  }
  return per_radian;
}

// Two tilts of points that lie close together along the axis tell its lean no better than they tell the arms.
Outcome<Fit, Refusal> refuseUncertainLean(Outcome<Fit, Refusal> fit, double sigma) {
  if (!fit) return fit;
  const double design = std::sqrt(fit->cofactor.diagonal().segment<2>(2).maxCoeff()) / sigma;
  if (design <= kMostLeanPerMm) return fit;
  return Refusal{"ill-conditioned",
                 "the readings do not determine the lean of the axis (an error of 1 um in a reading changes it by " +
                     text(1e-3 * design) +
                     " rad): read at a third tilt, or points that lie further apart along the axis"};
}

// Weights of the stops from a fit without.
Outcome<Fit, Refusal> fitInSpace(const std::vector<TiltReading>& readings, const TiltNoise& noise) {
  const double sigma = noise.position.value;
  TRY(const auto flat, fitTilts(readings, false, {noise.position, 0.0, {}}));
  const auto plain = [&](const VectorXd& at) { return pivotModel(readings, sigma, at); };
  auto fit = refuseUncertainLean(
      refuseUncertainPivot(leastSquares(plain, startFrom(flat, readings)), readings.size(), sigma), sigma);
  if (!fit || noise.angle <= 0.0) return fit;
  const VectorXd turning = turningOf(readings, sigma, fit->parameters);
  const auto weighted = [&](const VectorXd& at) { return withoutStops(plain(at), readings, turning, noise.angle); };
  return leastSquares(weighted, fit->parameters);
}

Outcome<Result, Refusal> solvePivot(const Dataset& dataset, const TiltReadings& tilts, const SwivelPlane& plane) {
  TRY(const auto noise, tiltNoise(dataset));
  TRY(const auto fit, fitInSpace(tilts.readings, noise));
  if (auto refusal = shortArm(fit, noise.position)) return *refusal;

  Answer answer{dataset, fit, noise.position};
  for (const auto& warning : noise.warnings) answer.warn(warning);
  if (const auto warning = anglesApart(tilts)) answer.warn(*warning);
  constexpr std::array<std::string_view, 3> kParts{"first of the plane", "second of the plane", "along the axis"};
  const Table& table = *dataset.table("readings");
  answer.readings(table, kParts, table.column(column::kB) ? column::kB : kTilt);
  const auto promise = [&](const std::string& key, Index from) {
    Eigen::Vector2d values = fit.parameters.segment<2>(from);
    Eigen::MatrixXd rows = pick(from, 2, fit.parameters.size());
    if (!plane.alphabetical()) {
      values = values.reverse().eval();
      rows = rows.colwise().reverse().eval();
    }
    answer.promiseVector(key, values, rows);
  };
  promise("pivot_" + plane.name() + "_mm", 0);
  promise("lean_" + plane.name() + "_rad", 2);
  answer.result().also.push_back(Estimate::scalar(quantity::kAlong, tilts.centre_along, std::nullopt));
  answer.result().convention = "where the axis passes along_mm, and its lateral change per mm along the machine axis";
  return std::move(answer).take(true);
}

}  // namespace

Vector3d TiltAxis::tilted(const Vector3d& at, double tilt_rad) const {
  return point + Eigen::AngleAxisd{tilt_rad, direction.normalized()} * (at - point);
}

Outcome<Result, Refusal> solveTablePivot3d(const Dataset& dataset) {
  TRY(const auto plane, swivelPlane(dataset, "tilt_axis"));
  TRY(const auto table, checkedTable(dataset, "readings", kTableTiltColumns));
  return solvePivot(dataset, tiltReadings(*table, plane, nullptr), plane);
}

Outcome<Result, Refusal> solveHeadPivot3d(const Dataset& dataset) {
  TRY(const auto plane, swivelPlane(dataset, "swivel_axis"));
  TRY(const auto ball, tiltedBall(dataset));
  TRY(const auto table, checkedTable(dataset, "readings", kHeadTiltColumns));
  return solvePivot(dataset, tiltReadings(*table, plane, &ball), plane);
}

namespace {

constexpr Quantity kLeanXz{.key = result_key::kLeanXz, .kind = QuantityKind::lean, .most = quantity::kMostLean_rad};
constexpr Quantity kLeanYz{.key = result_key::kLeanYz, .kind = QuantityKind::lean, .most = quantity::kMostLean_rad};
constexpr Quantity kLeanXy{.key = result_key::kLeanXy, .kind = QuantityKind::lean, .most = quantity::kMostLean_rad};
constexpr Quantity kPivotAxisFurther[]{
    quantity::kPivotXz, quantity::kPivotYz, quantity::kPivotXy, quantity::kAlong, kLeanXz, kLeanYz, kLeanXy};
constexpr Quantity kPivotAxisTableResults[]{
    quantity::kPivotYz.as("the tilt axis across X; pivot_xz_mm of a tilt about Y, pivot_xy_mm about Z"),
    kLeanYz.as("angle by which the axis leans in that plane; likewise lean_xz_rad, lean_xy_rad")};
constexpr Quantity kPivotAxisHeadResults[]{
    quantity::kPivotXz.as("a swivel about Y, from the moving reference; pivot_yz_mm about X, pivot_xy_mm about Z"),
    kLeanXz.as("angle by which the axis leans in that plane; likewise lean_yz_rad, lean_xy_rad")};

}  // namespace

const Method kTablePivot3d{.name = "table-pivot-3d",
                           .title = "Axis of a tilting table in space",
                           .equations = "(B31), (B32)",
                           .source = source::kMachine,
                           .solver = solveTablePivot3d,
                           .tables = kTableTiltTables,
                           .keys = kTableTiltKeys,
                           .results = kPivotAxisTableResults,
                           .further = kPivotAxisFurther,
                           .unobservable = kTableTiltUnobservable,
                           .subject = {.about = Subject{SubjectKind::table_pivot}}};

const Method kHeadPivot3d{.name = "head-pivot-3d",
                          .title = "Axis of a swivelling head in space",
                          .equations = "(B30), (B32)",
                          .source = source::kMachine,
                          .solver = solveHeadPivot3d,
                          .tables = kHeadTiltTables,
                          .keys = kHeadTiltKeys,
                          .known = kBallKnown,
                          .results = kPivotAxisHeadResults,
                          .further = kPivotAxisFurther,
                          .unobservable = kHeadTiltUnobservable,
                          .subject = {.about = Subject{SubjectKind::head_pivot}}};

}  // namespace probebox::metrology
