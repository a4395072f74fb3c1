#include "firmware/metrology/fit/sphere.hpp"

#include <cmath>
#include <string>

#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/points.hpp"

namespace probebox::metrology {
namespace {

// Thickness against width below which points count as one plane: at 1 % the centre is a hundred times less certain than
// a point, and the side on which it lies is a guess.
constexpr double kFlat = 0.01;

std::optional<Refusal> badGeometry(const Eigen::Ref<const Rows3>& points, const SphereQuestion& question) {
  const bool radius_known = question.radius.has_value();
  const Eigen::Index needed = radius_known ? 3 : 4;
  if (points.rows() < needed) {
    return Refusal{"too-few-readings", std::to_string(points.rows()) + " points where a sphere " +
                                           (radius_known ? "of known radius " : "") + "needs " +
                                           std::to_string(needed) +
                                           ": touch more (five are usual: +x, -x, +y, -y, +z)"};
  }
  if (auto refusal = equalPoints(points)) return refusal;
  const Eigen::VectorXd widths = widthsOf(points);
  const bool side_known = radius_known && question.approximate_centre;
  if (widths[side_known ? 1 : 0] < kFlat * widths[2]) {
    return Refusal{"coplanar",
                   "the points lie in one plane or on a small cap and do not determine the centre: touch the sphere "
                   "from more sides" +
                       std::string{radius_known ? ", or give approximate_centre_mm" : ""}};
  }
  return std::nullopt;
}

}  // namespace

std::optional<Ball> algebraicBall(const Eigen::MatrixXd& points) {
  const Eigen::Index dimensions = points.cols();
  const Eigen::RowVectorXd mean = points.colwise().mean();
  const Eigen::MatrixXd centred = points.rowwise() - mean;
  Eigen::MatrixXd rows{points.rows(), dimensions + 1};
  rows << 2.0 * centred, Eigen::VectorXd::Ones(points.rows());
  const auto solution = solveFullRank(rows, centred.rowwise().squaredNorm());
  if (!solution) return std::nullopt;
  const Eigen::VectorXd centre = solution->topRows(dimensions);
  const double squared = (*solution)(dimensions, 0) + centre.squaredNorm();
  if (!(squared > 0.0)) return std::nullopt;
  return Ball{centre + mean.transpose(), std::sqrt(squared)};
}

Outcome<Fit, Refusal> fitSphere(const Eigen::Ref<const Rows3>& points, const SphereQuestion& question) {
  if (auto refusal = badGeometry(points, question)) return *refusal;
  const auto& radius = question.radius;
  Eigen::VectorXd start{radius ? 3 : 4};
  if (radius && question.approximate_centre) {
    start = *question.approximate_centre;
  } else if (const auto ball = algebraicBall(points)) {
    start.head(3) = ball->centre;
    if (!radius) start[3] = ball->radius;
  } else {
    return Refusal{"coplanar", "no sphere passes near the points: touch the sphere from more sides"};
  }
  return leastSquares(
      [&](const Eigen::VectorXd& at) {
        const double r = radius ? *radius : at[3];
        Linearised model{Eigen::VectorXd{points.rows()}, Eigen::MatrixXd{points.rows(), at.size()}};
        for (Eigen::Index i = 0; i < points.rows(); ++i) {
          const Eigen::RowVector3d arm = points.row(i) - at.head(3).transpose();
          model.residuals[i] = (arm.norm() - r) / question.sigma;
          model.jacobian.row(i).head(3) = -arm.normalized() / question.sigma;
          if (!radius) model.jacobian(i, 3) = -1.0 / question.sigma;
        }
        return model;
      },
      start, question.outliers);
}

}  // namespace probebox::metrology
