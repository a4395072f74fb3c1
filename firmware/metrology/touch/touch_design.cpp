#include "firmware/metrology/touch/touch_design.hpp"

#include <cmath>

#include "firmware/metrology/fit/decompositions.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Columns: centre in the span of the normals, delays, radius unless it is known.
MatrixXd rowsOf(std::span<const Retract> retracts, const TouchFit& fit, const TouchQuestion& question,
                const MatrixXd& span) {
  const Index n = span.cols();
  const Index delays = question.delayCount();
  MatrixXd rows{static_cast<Index>(retracts.size()), n + delays + (question.size_mm ? 0 : 1)};
  for (Index i = 0; i < rows.rows(); ++i) {
    const Retract& touch = retracts[static_cast<std::size_t>(i)];
    rows.row(i).head(n) = -(span.transpose() * touch.plan.normal).transpose();
    if (question.delays == Delays::common) {
      rows(i, n) = fit.normal_speed[i];
    } else {
      const Eigen::Matrix3Xd carried = dPointPerDelay(touch, question, separationTime(touch.probe), fit.tau_s);
      rows.row(i).segment(n, delays) = touch.plan.normal.transpose() * carried;
    }
    if (!question.size_mm) rows(i, n + delays) = -1.0;
  }
  return rows;
}

}  // namespace

std::optional<MatrixXd> unitCofactor(const MatrixXd& rows) {
  const Eigen::RowVectorXd scale = rows.colwise().norm().cwiseInverse();
  const MatrixXd scaled = rows * scale.asDiagonal();
  const auto inverted = inverseIfRegular(scaled.transpose() * scaled);
  if (!inverted) return std::nullopt;
  return MatrixXd{scale.asDiagonal() * *inverted * scale.asDiagonal()};
}

TouchDesign touchDesign(std::span<const Retract> retracts, const TouchFit& fit, const TouchQuestion& question) {
  MatrixXd normals{static_cast<Index>(retracts.size()), 3};
  for (Index i = 0; i < normals.rows(); ++i) {
    normals.row(i) = retracts[static_cast<std::size_t>(i)].plan.normal.transpose();
  }
  const MatrixXd span = spanOf(normals);
  const MatrixXd rows = rowsOf(retracts, fit, question, span);
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
  if (!question.size_mm) design.size = {2.0 * std::sqrt(cofactor(rows.cols() - 1, rows.cols() - 1))};
  return design;
}

}  // namespace probebox::metrology
