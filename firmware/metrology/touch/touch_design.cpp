#include "firmware/metrology/touch/touch_design.hpp"

#include <cmath>

#include "firmware/metrology/fit/decompositions.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Columns: centre in the span of the normals, delays, lost motion, radius unless the delay came from it. A row for each
// way: the ways in are mirrored by speed and lost motion.
MatrixXd rowsOf(const AgreedTouches& touches, const TouchQuestion& question, const MatrixXd& span) {
  const Index n = span.cols();
  const Index delays = question.delayCount();
  const Index lost = touches.whole ? touches.whole->lost_mm.size() : 0;
  const bool sized = touches.whole || !question.size_mm;
  const auto count = static_cast<Index>(touches.retracts.size());
  MatrixXd out = MatrixXd::Zero(count, n + delays + lost + (sized ? 1 : 0));
  for (Index i = 0; i < count; ++i) {
    const Retract& touch = touches.retracts[static_cast<std::size_t>(i)];
    const Eigen::Vector3d& normal = touch.plan.normal;
    out.row(i).head(n) = -(span.transpose() * normal).transpose();
    if (question.delays == Delays::common) {
      out(i, n) = touches.fit.normal_speed[i];
    } else {
      const Eigen::Matrix3Xd carried = dPointPerDelay(touch, question, separationTime(touch.probe), touches.fit.tau_s);
      out.row(i).segment(n, delays) = normal.transpose() * carried;
    }
    const Eigen::RowVector3d of_axes =
        -0.5 * touch.plan.retract.cwiseAbs().transpose() * normal.dot(touch.plan.retract);
    if (lost == 3) out.row(i).segment<3>(n + delays) = of_axes;
    if (lost == 1) out(i, n + delays) = of_axes.sum();
    if (sized) out(i, out.cols() - 1) = -1.0;
  }
  if (!touches.whole) return out;
  MatrixXd both{2 * count, out.cols()};
  both << out, out;
  both.bottomRows(count).middleCols(n, delays + lost) *= -1.0;
  return both;
}

}  // namespace

std::optional<MatrixXd> unitCofactor(const MatrixXd& rows) {
  const Eigen::RowVectorXd scale = rows.colwise().norm().cwiseInverse();
  const MatrixXd scaled = rows * scale.asDiagonal();
  const auto inverted = inverseIfRegular(scaled.transpose() * scaled);
  if (!inverted) return std::nullopt;
  return MatrixXd{scale.asDiagonal() * *inverted * scale.asDiagonal()};
}

TouchDesign touchDesign(const AgreedTouches& touches, const TouchQuestion& question) {
  const auto& retracts = touches.retracts;
  MatrixXd normals{static_cast<Index>(retracts.size()), 3};
  for (Index i = 0; i < normals.rows(); ++i) {
    normals.row(i) = retracts[static_cast<std::size_t>(i)].plan.normal.transpose();
  }
  const MatrixXd span = spanOf(normals);
  const MatrixXd rows = rowsOf(touches, question, span);
  const auto known = unitCofactor(rows);
  if (!known) return {};
  const MatrixXd& cofactor = *known;
  const Index n = span.cols();
  TouchDesign design;
  for (Index k = 0; k < question.delayCount(); ++k) design.tau_s_mm.push_back(std::sqrt(cofactor(n + k, n + k)));
  if (n == 3) {
    const Eigen::Matrix3d centre = span * cofactor.topLeftCorner<3, 3>() * span.transpose();
    for (Index k = 0; k < 3; ++k) design.centre.push_back(std::sqrt(centre(k, k)));
  }
  if (touches.whole || !question.size_mm) {
    design.size = {2.0 * std::sqrt(cofactor(rows.cols() - 1, rows.cols() - 1))};
  }
  return design;
}

}  // namespace probebox::metrology
