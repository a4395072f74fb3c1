#include "firmware/metrology/rotary/rotary_location.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>

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

ErrorMotions errorMotionsOf(const AngleErrors& errors, const Vector3d& direction, Eigen::Index offset) {
  const auto count = static_cast<Eigen::Index>(errors.angles.size());
  // Location and mean, which all angles share.
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(6, 6 * count);
  rows.topRows<3>() = locationMap(errors.angles, direction, offset);
  std::vector<Matrix3d> turned;
  Matrix3d mean_turned = Matrix3d::Zero();
  for (const double angle : errors.angles) {
    const auto k = static_cast<Eigen::Index>(turned.size());
    turned.push_back(Eigen::AngleAxisd{angle, direction}.toRotationMatrix());
    mean_turned += turned.back() / static_cast<double>(count);
    rows.block<3, 3>(3, 6 * k + offset) = Matrix3d::Identity() / static_cast<double>(count);
  }
  const Eigen::VectorXd common = rows * errors.six;
  const Eigen::MatrixXd shared = errors.cofactor.shared(rows), of_common = errors.cofactor.of(rows);
  ErrorMotions motions{Eigen::VectorXd{3 * count}, Eigen::VectorXd{3 * count}};
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto block = static_cast<std::size_t>(k);
    // The mean that is left is the error of the reference angle.
    Eigen::Matrix<double, 3, 6> by_common;
    by_common << turned[block] - mean_turned, -Matrix3d::Identity();
    motions.values.segment<3>(3 * k) = errors.six.segment<3>(6 * k + offset) + by_common * common;
    const Matrix3d own = errors.cofactor.of(block).block<3, 3>(offset, offset);
    const Matrix3d cross = errors.cofactor.with(block, rows, shared).middleRows<3>(offset) * by_common.transpose();
    const Matrix3d cofactor = own + cross + cross.transpose() + by_common * of_common * by_common.transpose();
    motions.roots.segment<3>(3 * k) = cofactor.diagonal().cwiseMax(0.0).cwiseSqrt();
  }
  return motions;
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

Answer answerOf(const Dataset& dataset, const Sigma& sigma, Fit quality, const AngleErrors& errors,
                const Vector3d& direction) {
  const Eigen::Index size = errors.six.size();
  const bool located = locationKnown(errors.angles);
  // The parameters of the answer: what its covariance tells, the errors only where they are few.
  const Eigen::Index listed = size <= kMostInCovariance ? size : 0;
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(listed + (located ? 6 : 0), size);
  rows.topRows(listed).setIdentity();
  if (located) {
    rows.middleRows<3>(listed) = locationMap(errors.angles, direction, 0);
    rows.bottomRows<3>() = locationMap(errors.angles, direction, 3);
  }
  quality.parameters = rows * errors.six;
  quality.cofactor = errors.cofactor.of(rows);
  Answer answer{dataset, quality, sigma};
  if (listed > 0) {
    answer.promiseMatrix(quantity::kSixErrors, 6, errors.six, pick(0, listed, rows.rows()));
  } else {
    Eigen::VectorXd roots{size};
    for (std::size_t k = 0; k < errors.angles.size(); ++k)
      roots.segment<6>(6 * static_cast<Eigen::Index>(k)) = errors.cofactor.of(k).diagonal().cwiseSqrt();
    answer.result().estimates.push_back(
        answer.withRoots(Estimate::matrix(quantity::kSixErrors, 6, {errors.six.begin(), errors.six.end()}, {}), roots));
  }
  answer.result().also.push_back(Estimate::vector(quantity::kErrorAngles, errors.angles, {}));
  answer.result().convention =
      "EX EY EZ EA EB EC of the table at each angle, about axis_point_mm, relative to the axis at zero";
  if (!located) {
    answer.warn("no location of the axis: it needs four or more angles that are spread wider than 60 degrees");
    return answer;
  }
  answer.promiseVector(quantity::kLocation, quality.parameters.segment<3>(listed), pick(listed, 3, rows.rows()));
  answer.promiseVector(quantity::kTilt, quality.parameters.tail<3>(), pick(listed + 3, 3, rows.rows()));
  const auto tell = [&](std::string_view key, Eigen::Index offset) {
    const auto motions = errorMotionsOf(errors, direction, offset);
    answer.result().also.push_back(
        answer.withRoots(Estimate::matrix(key, 3, {motions.values.begin(), motions.values.end()}, {}), motions.roots));
  };
  tell(quantity::kErrorMotions, 0);
  tell(quantity::kTiltMotions, 3);
  return answer;
}

}  // namespace probebox::metrology
