#include "firmware/metrology/fit/block_least_squares.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/least_squares.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kInfiniteCondition = std::numeric_limits<double>::infinity();

// All rows at one place, columns scaled to length 1.
struct ScaledBlocks {
  std::vector<BlockRows> rows;
  std::vector<VectorXd> own_norms;
  VectorXd common_norms;
  double squares{};  // of the residuals
  double longest{};  // norm of a column
  bool determined{true};
};

Outcome<ScaledBlocks, Refusal> scaledAt(const BlockModel& model, const BlockUnknowns& at) {
  ScaledBlocks scaled;
  VectorXd squares = VectorXd::Zero(at.common.size());
  for (std::size_t k = 0; k <= at.own.size(); ++k) {
    auto block = model(k, at);
    if (!block.residuals.allFinite() || !block.own.allFinite() || !block.common.allFinite())
      return Refusal{"not-finite", "the fit diverged: look for a gross error in the readings"};
    if (block.residuals.size() < block.own.cols()) {
      return Refusal{"too-few-readings", std::to_string(block.residuals.size()) + " equations for " +
                                             std::to_string(block.own.cols()) +
                                             " unknowns of one block: take more readings of each"};
    }
    squares += block.common.colwise().squaredNorm();
    scaled.squares += block.residuals.squaredNorm();
    scaled.rows.push_back(std::move(block));
  }
  scaled.common_norms = squares.cwiseSqrt();
  const auto look = [&](const VectorXd& norms) {
    if (norms.size() == 0) return;
    scaled.longest = std::max(scaled.longest, norms.maxCoeff());
    scaled.determined = scaled.determined && norms.minCoeff() > 0;
  };
  look(scaled.common_norms);
  for (std::size_t k = 0; k < at.own.size(); ++k) {
    scaled.own_norms.emplace_back(scaled.rows[k].own.colwise().norm());
    look(scaled.own_norms.back());
  }
  if (!scaled.determined) return scaled;
  for (std::size_t k = 0; k < scaled.rows.size(); ++k) {
    scaled.rows[k].common.array().rowwise() /= scaled.common_norms.transpose().array();
    if (k < at.own.size()) scaled.rows[k].own.array().rowwise() /= scaled.own_norms[k].transpose().array();
  }
  return scaled;
}

// The scaled Jacobian as an upper triangle: own columns of each block first, the common ones last.
struct BlockTriangle {
  std::vector<MatrixXd> own;      // R of a block
  std::vector<MatrixXd> coupled;  // beside it: columns of the common unknowns
  std::vector<VectorXd> values;   // beside it: the residuals
  MatrixXd common;                // below: R of the common unknowns, and its residuals in the last column
};

BlockTriangle triangleOf(const ScaledBlocks& scaled) {
  const Index columns = scaled.common_norms.size() + 1;
  BlockTriangle triangle;
  triangle.common = MatrixXd::Zero(columns, columns);
  for (std::size_t k = 0; k < scaled.rows.size(); ++k) {
    const auto& [residuals, own, common] = scaled.rows[k];
    MatrixXd others{residuals.size(), columns};
    others << common, residuals;
    MatrixXd rest = others;
    if (k < scaled.own_norms.size()) {
      auto [upper, beside, below] = eliminated(own, others);
      triangle.own.push_back(std::move(upper));
      triangle.coupled.emplace_back(beside.leftCols(columns - 1));
      triangle.values.emplace_back(beside.rightCols<1>());
      rest = std::move(below);
    }
    MatrixXd stacked{columns + rest.rows(), columns};
    stacked << triangle.common, rest;
    triangle.common = eliminated(stacked, MatrixXd::Zero(stacked.rows(), 0)).upper;
  }
  return triangle;
}

double leastDiagonal(const BlockTriangle& triangle) {
  const Index count = triangle.common.cols() - 1;
  double least = count > 0 ? triangle.common.diagonal().head(count).cwiseAbs().minCoeff() : kInfiniteCondition;
  for (const auto& own : triangle.own) least = std::min(least, own.diagonal().cwiseAbs().minCoeff());
  return least;
}

// Condition number of the triangle, by bisection for the extreme eigenvalues of its normal matrix N: N - x I is
// positive definite where its blocks and their Schur complement are.
class BlockCondition {
 public:
  explicit BlockCondition(const BlockTriangle& triangle) {
    const Index count = triangle.common.cols() - 1;
    const MatrixXd upper = triangle.common.topLeftCorner(count, count);
    common_ = upper.transpose() * upper;
    for (std::size_t k = 0; k < triangle.own.size(); ++k) {
      const MatrixXd& own = triangle.own[k];
      const auto axes = symmetricEigen(own.transpose() * own);
      coupled_.emplace_back(axes.vectors.transpose() * (own.transpose() * triangle.coupled[k]));
      common_ += triangle.coupled[k].transpose() * triangle.coupled[k];
      values_.push_back(axes.values);
    }
  }

  double number() const {
    double low = kLeastEigenvalue;
    if (!isBelowAll(low)) return kInfiniteCondition;
    double high = 1;  // the mean of all eigenvalues
    double least_width = kDigits;
    while (high / low > 1 + least_width) {
      const double middle = std::sqrt(low * high);
      (isBelowAll(middle) ? low : high) = middle;
    }
    double most = 2;
    while (!isAboveAll(most)) most *= 2;
    double under = most / 2;
    while (most / under > 1 + least_width) {
      const double middle = std::sqrt(most * under);
      (isAboveAll(middle) ? most : under) = middle;
    }
    return std::sqrt(most / low);
  }

 private:
  static constexpr double kLeastEigenvalue = 1e-14;
  static constexpr double kDigits = 1e-11;

  bool isBelowAll(double at) const {
    if (std::ranges::any_of(values_, [&](const VectorXd& values) { return !(values.minCoeff() > at); })) return false;
    return isPositiveDefinite(complementAt(at));
  }
  bool isAboveAll(double at) const {
    if (std::ranges::any_of(values_, [&](const VectorXd& values) { return !(values.maxCoeff() < at); })) return false;
    return isPositiveDefinite(-complementAt(at));
  }
  MatrixXd complementAt(double at) const {
    MatrixXd complement = common_ - at * MatrixXd::Identity(common_.rows(), common_.cols());
    for (std::size_t k = 0; k < values_.size(); ++k) {
      complement -= coupled_[k].transpose() * (values_[k].array() - at).inverse().matrix().asDiagonal() * coupled_[k];
    }
    return complement;
  }

  MatrixXd common_;
  std::vector<VectorXd> values_;   // eigenvalues of the normal matrix of each block
  std::vector<MatrixXd> coupled_;  // rows in its eigenvectors
};

Refusal notDetermined(double condition) {
  return {"ill-conditioned", "the readings do not determine the result (condition number " + text(condition) +
                                 "): spread them out further"};
}

// Moves the unknowns by one step. Returns the length of the scaled step.
double stepBy(const BlockTriangle& triangle, const ScaledBlocks& scaled, BlockUnknowns& at) {
  const Index count = at.common.size();
  const MatrixXd upper = triangle.common.topLeftCorner(count, count);
  const VectorXd common = inverseOfUpper(upper) * triangle.common.col(count).head(count);
  double squares = common.squaredNorm();
  at.common -= common.cwiseQuotient(scaled.common_norms);
  for (std::size_t k = 0; k < at.own.size(); ++k) {
    const VectorXd own = inverseOfUpper(triangle.own[k]) * (triangle.values[k] - triangle.coupled[k] * common);
    squares += own.squaredNorm();
    at.own[k] -= own.cwiseQuotient(scaled.own_norms[k]);
  }
  return std::sqrt(squares);
}

BlockCofactor cofactorOf(const BlockTriangle& triangle, const ScaledBlocks& scaled) {
  const Index count = scaled.common_norms.size();
  const MatrixXd common =
      scaled.common_norms.cwiseInverse().asDiagonal() * inverseOfUpper(triangle.common.topLeftCorner(count, count));
  BlockCofactor cofactor{{}, {}, common * common.transpose()};
  for (std::size_t k = 0; k < triangle.own.size(); ++k) {
    const MatrixXd own = scaled.own_norms[k].cwiseInverse().asDiagonal() * inverseOfUpper(triangle.own[k]);
    cofactor.own.emplace_back(own * own.transpose());
    cofactor.carried.emplace_back(-own * triangle.coupled[k] * scaled.common_norms.asDiagonal());
  }
  return cofactor;
}

double normOf(const BlockUnknowns& unknowns) {
  double squares = unknowns.common.squaredNorm();
  for (const auto& own : unknowns.own) squares += own.squaredNorm();
  return std::sqrt(squares);
}

}  // namespace

MatrixXd BlockCofactor::of(std::size_t block) const {
  return own[block] + carried[block] * common * carried[block].transpose();
}

MatrixXd BlockCofactor::shared(const MatrixXd& rows) const {
  MatrixXd sum = MatrixXd::Zero(rows.rows(), common.cols());
  Index from = 0;
  for (const auto& each : carried) {
    sum += rows.middleCols(from, each.rows()) * each;
    from += each.rows();
  }
  return sum;
}

MatrixXd BlockCofactor::of(const MatrixXd& rows) const {
  const MatrixXd common_part = shared(rows);
  MatrixXd sum = common_part * common * common_part.transpose();
  Index from = 0;
  for (const auto& each : own) {
    const auto part = rows.middleCols(from, each.rows());
    sum += part * each * part.transpose();
    from += each.rows();
  }
  return sum;
}

MatrixXd BlockCofactor::with(std::size_t block, const MatrixXd& rows, const MatrixXd& shared_part) const {
  const Index size = own[block].rows();
  const auto from = static_cast<Index>(block) * size;
  return own[block] * rows.middleCols(from, size).transpose() + carried[block] * common * shared_part.transpose();
}

Outcome<BlockFit, Refusal> leastSquaresInBlocks(const BlockModel& model, const BlockUnknowns& start) {
  constexpr int kMostSteps = 30;
  constexpr double kConverged = 1e-12;
  BlockFit fit{start, {}, 0, 0};
  double before = kInfiniteCondition, length = 0, rounding = 0;
  BlockTriangle triangle;
  ScaledBlocks scaled;
  for (int step = 0; step < kMostSteps; ++step) {
    TRY(scaled, scaledAt(model, fit.unknowns));
    Index rows = 0, unknowns = start.common.size();
    for (const auto& block : scaled.rows) rows += block.residuals.size();
    for (const auto& own : start.own) unknowns += own.size();
    if (rows < unknowns) {
      return Refusal{"too-few-readings", std::to_string(rows) + " equations for " + std::to_string(unknowns) +
                                             " unknowns: take more readings"};
    }
    fit.dof = static_cast<std::size_t>(rows - unknowns);
    if (!scaled.determined) return notDetermined(kInfiniteCondition);
    triangle = triangleOf(scaled);
    if (leastDiagonal(triangle) < 1e-3) {
      fit.condition = BlockCondition{triangle}.number();
      if (!(fit.condition <= kConditionLimit)) return notDetermined(fit.condition);
    }
    rounding = 1e-10 * normOf(fit.unknowns) * scaled.longest;
    length = stepBy(triangle, scaled, fit.unknowns);
    // Steps that no longer shrink are rounding.
    const bool stalled = length > 0.25 * before && length <= 1e-8 * (1.0 + std::sqrt(scaled.squares)) + rounding;
    if (length < kConverged || stalled) break;
    before = length;
  }
  fit.condition = BlockCondition{triangle}.number();
  if (!(fit.condition <= kConditionLimit)) return notDetermined(fit.condition);
  // Rounding may hold the step above its limit; a step that still matters may not.
  if (!(length <= 1e-6 * (1.0 + std::sqrt(scaled.squares)) + rounding))
    return Refusal{"no-convergence", "the fit does not converge: look for a gross error in the readings"};
  fit.cofactor = cofactorOf(triangle, scaled);
  return fit;
}

}  // namespace probebox::metrology
