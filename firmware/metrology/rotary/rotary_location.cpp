#include "firmware/metrology/rotary/rotary_location.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/angular_span.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kLeastSector = kTurn / 6.0;

// Whether the angles tell the location.
bool locationKnown(const std::vector<double>& angles) {
  return angles.size() >= 4 && angularSpan(angles, kTurn) >= kLeastSector;
}

}  // namespace

Outcome<NominalAxis, Refusal> nominalAxis(const Dataset& dataset) {
  TRY(const auto point, configVector(dataset, "axis_point_mm"));
  TRY(const auto direction, configDirection(dataset, "axis_direction"));
  if (!point || !direction) {
    return Refusal{"missing-key", "config.json needs axis_point_mm and axis_direction: the nominal axis"};
  }
  return NominalAxis{Vector3d{point.value().data()}, *direction};
}

void addNominalAxis(Result& result, const NominalAxis& axis) {
  result.also.push_back(Estimate::vector(quantity::kAxisPoint, {axis.point.begin(), axis.point.end()}, {}));
  result.also.push_back(Estimate::vector(quantity::kAxisDirection, {axis.direction.begin(), axis.direction.end()}, {}));
}

Eigen::MatrixXd locationMap(std::span<const double> angles, const Vector3d& direction, Eigen::Index offset) {
  const Vector3d across = direction.unitOrthogonal();
  Eigen::Matrix<double, 3, 2> plane;
  plane << across, direction.cross(across);
  const auto count = static_cast<Eigen::Index>(angles.size());
  Eigen::MatrixXd design{2 * count, 4};
  for (Eigen::Index k = 0; k < count; ++k) {
    const Matrix3d turned = Eigen::AngleAxisd{angles[static_cast<std::size_t>(k)], direction}.toRotationMatrix();
    const Eigen::Matrix2d seen = plane.transpose() * (plane - turned * plane);
    design.middleRows<2>(2 * k) << seen, Eigen::Matrix2d::Identity();
  }
  const Eigen::MatrixXd solve = solveCholesky(design.transpose() * design, design.transpose());
  Eigen::MatrixXd map = Eigen::MatrixXd::Zero(3, 6 * count);
  for (Eigen::Index k = 0; k < count; ++k) {
    map.middleCols<3>(6 * k + offset) = plane * solve.block(0, 2 * k, 2, 2) * plane.transpose();
  }
  return map;
}

Eigen::MatrixXd positionDependentMap(std::span<const double> angles, const Vector3d& direction, Eigen::Index offset) {
  const auto count = static_cast<Eigen::Index>(angles.size());
  const Eigen::MatrixXd location = locationMap(angles, direction, offset);
  Eigen::MatrixXd map = Eigen::MatrixXd::Zero(3 * count, 6 * count);
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(3, 6 * count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const Matrix3d turned = Eigen::AngleAxisd{angles[static_cast<std::size_t>(k)], direction}.toRotationMatrix();
    map.middleRows<3>(3 * k) = (turned - Matrix3d::Identity()) * location;
    map.block<3, 3>(3 * k, 6 * k + offset) += Matrix3d::Identity();
    mean += map.middleRows<3>(3 * k) / static_cast<double>(count);
  }
  // The mean that is left is the error of the reference angle.
  for (Eigen::Index k = 0; k < count; ++k) map.middleRows<3>(3 * k) -= mean;
  return map;
}

std::vector<double> distinctAngles(std::vector<double> angles) {
  std::ranges::sort(angles);
  const auto same = [](double a, double b) { return std::abs(a - b) < kSameTableAngle_rad; };
  angles.erase(std::ranges::unique(angles, same).begin(), angles.end());
  return angles;
}

std::optional<Refusal> tooLargeErrors(const std::vector<double>& angles, const Eigen::VectorXd& six) {
  // A hundred times what a poor axis tilts by, and a chosen one for how far it moves; taken for small angles (E5).
  constexpr double kMost_rad = 0.02, kMost_mm = 1.0;
  for (Eigen::Index k = 0; k < six.size(); ++k) {
    const bool turns = k % 6 >= 3;
    if (std::abs(six[k]) <= (turns ? kMost_rad : kMost_mm)) continue;
    const std::string where = "at " + text(degrees(angles[static_cast<std::size_t>(k / 6)])) + " degrees the table is ";
    const std::string by = text(std::abs(six[k]));
    if (turns)
      return Refusal{"errors-too-large",
                     where + "turned by " + by +
                         " rad from where it should be: check the sign of axis_direction and of phi_rad, their unit, "
                         "and the numbers of the balls"};
    return Refusal{"errors-too-large",
                   where + "moved by " + by +
                       " mm from where it should be: check the signs and unit of the readings at this angle, and that "
                       "axis_point_mm is on the axis"};
  }
  return std::nullopt;
}

void promiseErrors(Answer& answer, const std::vector<double>& angles, const Eigen::VectorXd& six,
                   const Eigen::MatrixXd& rows, const Vector3d& direction) {
  answer.promiseMatrix(quantity::kSixErrors, 6, six, rows);
  answer.result().also.push_back(Estimate::vector(quantity::kErrorAngles, angles, {}));
  answer.result().convention =
      "EX EY EZ EA EB EC of the table at each angle, about axis_point_mm, relative to the axis at zero";
  if (!locationKnown(angles)) {
    answer.warn("no location of the axis: it needs four or more angles that are spread wider than 60 degrees");
    return;
  }
  const Eigen::MatrixXd location = locationMap(angles, direction, 0);
  const Eigen::MatrixXd tilt = locationMap(angles, direction, 3);
  answer.promiseVector(quantity::kLocation, location * six, location * rows);
  answer.promiseVector(quantity::kTilt, tilt * six, tilt * rows);
  const Eigen::MatrixXd translations = positionDependentMap(angles, direction, 0);
  const Eigen::MatrixXd rotations = positionDependentMap(angles, direction, 3);
  answer.alsoMatrix(quantity::kErrorMotions, 3, translations * six, translations * rows);
  answer.alsoMatrix(quantity::kTiltMotions, 3, rotations * six, rotations * rows);
}

}  // namespace probebox::metrology
