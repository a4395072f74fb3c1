#include "firmware/metrology/pivot_axis.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/answer.hpp"
#include "firmware/metrology/ball_readings.hpp"
#include "firmware/metrology/swivel_plane.hpp"
#include "firmware/metrology/tilt_readings.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr std::array<std::string_view, 5> kTableColumns{"tilt_deg", "C_deg", "x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, 5> kHeadColumns{"B_deg", "A_deg", "x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, 2> kTableKeys{"tilt_axis", "sigma_mm"};
constexpr std::array<std::string_view, 3> kHeadKeys{"ball_mm", "swivel_axis", "sigma_mm"};
constexpr double kDegree = std::numbers::pi / 180.0;
constexpr Index kAxis = 4;  // parameters of the axis: pivot, lean

// Coordinates across the axis, then along it from the mean of the readings.
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

// The fit in the plane, the axis parallel to its machine axis: pivot and points.
Outcome<VectorXd, Refusal> startOf(const std::vector<TiltReading>& readings, Index points) {
  const auto rows = static_cast<Index>(2 * readings.size());
  Eigen::MatrixXd design = Eigen::MatrixXd::Zero(rows, 2 + 2 * points);
  VectorXd values{rows};
  VectorXd start = VectorXd::Zero(kAxis + 3 * points);
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const auto row = static_cast<Index>(2 * k);
    const auto point = static_cast<Index>(readings[k].point);
    design.block<2, 2>(row, 0).setIdentity();
    design.block<2, 2>(row, 2 + 2 * point) = turn(readings[k].tilt_deg * kDegree);
    values.segment<2>(row) = readings[k].at;
    start[kAxis + 3 * point + 2] = readings[k].along;
  }
  const auto fit = linearLeastSquares(design, values);
  if (!fit) return fit.error();
  start.head<2>() = fit->parameters.head<2>();
  for (Index point = 0; point < points; ++point) {
    start.segment<2>(kAxis + 3 * point) = fit->parameters.head<2>() + fit->parameters.segment<2>(2 + 2 * point);
  }
  return start;
}

std::optional<Refusal> shortArm(const Fit& fit, const Sigma& sigma) {
  double longest = 0.0;
  for (Index point = kAxis; point < fit.parameters.size(); point += 3) {
    longest = std::max(longest, (fit.parameters.segment<2>(point) - fit.parameters.head<2>()).norm());
  }
  if (!sigma.stated || longest >= 5.0 * sigma.value) return std::nullopt;
  return Refusal{"arm-too-short",
                 "the ball lies " + text(longest) + " mm from the axis, less than 5 sigma: move it further out"};
}

Outcome<Result, Refusal> solvePivot(const Dataset& dataset, const TiltReadings& tilts, const SwivelPlane& plane,
                                    std::span<const std::string_view> keys) {
  const auto sigma = configSigma(dataset, "sigma_mm");
  if (!sigma) return sigma.error();
  const auto& readings = tilts.readings;
  if (auto refusal = refuseSpan(readings)) return *refusal;
  const auto points = static_cast<Index>(1 + std::ranges::max(readings, {}, &TiltReading::point).point);
  const auto start = startOf(readings, points);
  if (!start) return start.error();
  const auto fit =
      leastSquares([&](const VectorXd& at) { return pivotModel(readings, sigma->value, at); }, start.value());
  if (!fit) return fit.error();
  if (auto refusal = shortArm(fit.value(), sigma.value())) return *refusal;

  Answer answer{dataset, fit.value(), sigma.value()};
  const auto promise = [&](const std::string& key, Index from) {
    Eigen::Vector2d values = fit->parameters.segment<2>(from);
    Eigen::MatrixXd rows = pick(from, 2, fit->parameters.size());
    if (!plane.alphabetical()) {
      values = values.reverse().eval();
      rows = rows.colwise().reverse().eval();
    }
    answer.promiseVector(key, values, rows);
  };
  promise("pivot_" + plane.name() + "_mm", 0);
  promise("lean_" + plane.name() + "_rad", 2);
  answer.result().also.push_back(Estimate::scalar("along_mm", tilts.mean_along, std::nullopt));
  for (auto& warning : unusedKeys(dataset, keys)) answer.warn(std::move(warning));
  answer.result().convention = "where the axis passes along_mm, and its way across per mm along the machine axis";
  return std::move(answer).take(true);
}

}  // namespace

Vector3d TiltAxis::tilted(const Vector3d& at, double tilt_rad) const {
  return point + Eigen::AngleAxisd{tilt_rad, direction.normalized()} * (at - point);
}

Outcome<Result, Refusal> solveTablePivot3d(const Dataset& dataset) {
  const auto plane = swivelPlane(dataset, "tilt_axis");
  if (!plane) return plane.error();
  const auto table = checkedTable(dataset, "readings", kTableColumns);
  if (!table) return table.error();
  return solvePivot(dataset, tiltReadings(**table, plane.value(), nullptr), plane.value(), kTableKeys);
}

Outcome<Result, Refusal> solveHeadPivot3d(const Dataset& dataset) {
  const auto plane = swivelPlane(dataset, "swivel_axis");
  if (!plane) return plane.error();
  const auto ball = configVector(dataset, "ball_mm");
  if (!ball) return ball.error();
  if (!ball.value()) return Refusal{"missing-key", "config.json has no key 'ball_mm': give the ball's place"};
  const auto table = checkedTable(dataset, "readings", kHeadColumns);
  if (!table) return table.error();
  const Vector3d place{ball->value().data()};
  return solvePivot(dataset, tiltReadings(**table, plane.value(), &place), plane.value(), kHeadKeys);
}

}  // namespace probebox::metrology
