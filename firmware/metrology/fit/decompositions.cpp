#include "firmware/metrology/fit/decompositions.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>
#include <utility>

namespace probebox::metrology {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

using Pivoted = Eigen::ColPivHouseholderQR<MatrixXd>;
using PlainInPlace = Eigen::HouseholderQR<Eigen::Ref<MatrixXd>>;
using Svd = Eigen::JacobiSVD<MatrixXd>;
using Eigensolver = Eigen::SelfAdjointEigenSolver<MatrixXd>;

MatrixXd upperOf(const MatrixXd& packed) {
  return packed.topRows(packed.cols()).triangularView<Eigen::Upper>();
}

}  // namespace

MatrixXd solveLeastSquares(const MatrixXd& rows, const MatrixXd& values) {
  return Pivoted{rows}.solve(values);
}

std::optional<MatrixXd> solveFullRank(const MatrixXd& rows, const MatrixXd& values) {
  const Pivoted qr{rows};
  if (qr.rank() < rows.cols()) return std::nullopt;
  return MatrixXd{qr.solve(values)};
}

FactoredSolution solveInPlace(MatrixXd& rows, const VectorXd& values) {
  FactoredSolution result;
  result.solution = PlainInPlace{rows}.solve(values);
  result.upper = upperOf(rows);
  return result;
}

FactoredSolution solveRefined(const MatrixXd& rows, const VectorXd& values) {
  MatrixXd packed = rows;
  const PlainInPlace qr{packed};
  FactoredSolution result{qr.solve(values), upperOf(packed)};
  const VectorXd left = values - rows * result.solution;
  result.solution += VectorXd{qr.solve(left)};
  return result;
}

Eliminated eliminated(const MatrixXd& columns, const MatrixXd& others) {
  MatrixXd packed = columns;
  const PlainInPlace qr{packed};
  const MatrixXd rotated = qr.householderQ().adjoint() * others;
  return {upperOf(packed), rotated.topRows(columns.cols()), rotated.bottomRows(columns.rows() - columns.cols())};
}

MatrixXd inverseOfUpper(const MatrixXd& upper) {
  MatrixXd inverse = MatrixXd::Identity(upper.cols(), upper.cols());
  upper.triangularView<Eigen::Upper>().solveInPlace(inverse);
  return inverse;
}

MatrixXd orthonormalColumns(const MatrixXd& columns) {
  MatrixXd packed = columns;
  return PlainInPlace{packed}.householderQ() * MatrixXd::Identity(columns.rows(), columns.cols());
}

MatrixXd complementOf(const VectorXd& direction) {
  // A mirror that takes the first axis to +/- direction takes the others across it.
  VectorXd across_mirror = direction;
  across_mirror[0] += std::copysign(1.0, direction[0]);
  const MatrixXd mirror = MatrixXd::Identity(direction.size(), direction.size()) -
                          across_mirror * across_mirror.transpose() * (2.0 / across_mirror.squaredNorm());
  return mirror.rightCols(direction.size() - 1);
}

MatrixXd solveSquare(const MatrixXd& matrix, const MatrixXd& right) {
  return Eigen::FullPivLU<MatrixXd>{matrix}.solve(right);
}

std::optional<MatrixXd> solveInvertible(const MatrixXd& matrix, const MatrixXd& right,
                                        std::optional<double> threshold) {
  Eigen::FullPivLU<MatrixXd> lu{matrix};
  if (threshold) lu.setThreshold(*threshold);
  if (!lu.isInvertible()) return std::nullopt;
  return MatrixXd{lu.solve(right)};
}

VectorXd solutionOf(const MatrixXd& matrix, const VectorXd& right) {
  return solveSquare(matrix, right);
}

std::optional<VectorXd> solutionIfInvertible(const MatrixXd& matrix, const VectorXd& right) {
  auto solution = solveInvertible(matrix, right);
  if (!solution) return std::nullopt;
  return VectorXd{std::move(*solution)};
}

MatrixXd solveCholesky(const MatrixXd& normal, const MatrixXd& right) {
  return Eigen::LDLT<MatrixXd>{normal}.solve(right);
}

MatrixXd lowerCholesky(const MatrixXd& covariance) {
  return Eigen::LLT<MatrixXd>{covariance}.matrixL();
}

bool isPositiveDefinite(const MatrixXd& symmetric) {
  return Eigen::LLT<MatrixXd>{symmetric}.info() == Eigen::Success;
}

MatrixXd inverse(const MatrixXd& matrix) {
  return Eigen::FullPivLU<MatrixXd>{matrix}.inverse();
}

Matrix6d inverse(const Matrix6d& matrix) {
  return inverse(MatrixXd{matrix});
}

Eigen::Matrix3d inverse(const Eigen::Matrix3d& matrix) {
  return matrix.inverse();
}

Eigen::Matrix2d inverse(const Eigen::Matrix2d& matrix) {
  return matrix.inverse();
}

std::optional<MatrixXd> inverseIfRegular(const MatrixXd& matrix) {
  return solveInvertible(matrix, MatrixXd::Identity(matrix.rows(), matrix.cols()));
}

MatrixXd pseudoInverse(const MatrixXd& matrix) {
  const Svd svd{matrix, Eigen::ComputeThinU | Eigen::ComputeThinV};
  const auto kept = svd.rank();
  const VectorXd inverse = svd.singularValues().head(kept).cwiseInverse();
  return svd.matrixV().leftCols(kept) * inverse.asDiagonal() * svd.matrixU().leftCols(kept).transpose();
}

double determinant(const MatrixXd& matrix) {
  return Eigen::FullPivLU<MatrixXd>{matrix}.determinant();
}

VectorXd singularValues(const MatrixXd& matrix) {
  return Svd{matrix}.singularValues();
}

SingularSystem singularSystem(const MatrixXd& matrix) {
  const Svd svd{matrix, Eigen::ComputeThinU | Eigen::ComputeThinV};
  return {svd.singularValues(), svd.matrixU(), svd.matrixV()};
}

VectorXd symmetricEigenvalues(const MatrixXd& matrix) {
  return Eigensolver{matrix, Eigen::EigenvaluesOnly}.eigenvalues();
}

SymmetricEigen symmetricEigen(const MatrixXd& matrix) {
  const Eigensolver solver{matrix};
  return {solver.eigenvalues(), solver.eigenvectors()};
}

}  // namespace probebox::metrology
