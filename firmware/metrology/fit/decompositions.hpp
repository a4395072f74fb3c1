#pragma once
#include <Eigen/Core>
#include <optional>

// Linear algebra that needs a decomposition. Only this room instantiates decompositions: each costs seconds of compile
// time per file. All matrices are dense; an argument may be any expression, which is evaluated first.
namespace probebox::metrology {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

// Solves rows * x = values by least squares, one column of x for each column of values. An unknown whose column of rows
// depends on the others gets 0.
Eigen::MatrixXd solveLeastSquares(const Eigen::MatrixXd& rows, const Eigen::MatrixXd& values);

// The same; nothing when the columns of rows depend on each other.
std::optional<Eigen::MatrixXd> solveFullRank(const Eigen::MatrixXd& rows, const Eigen::MatrixXd& values);

struct FactoredSolution {
  Eigen::VectorXd solution;
  Eigen::MatrixXd upper;  // R of rows = QR
};

// Solves rows * x = values by least squares for independent columns. Overwrites rows.
FactoredSolution solveInPlace(Eigen::MatrixXd& rows, const Eigen::VectorXd& values);

// The same with one step of iterative refinement, which removes rounding errors.
FactoredSolution solveRefined(const Eigen::MatrixXd& rows, const Eigen::VectorXd& values);

// Rows [columns | others] rotated so that columns are upper triangular. rows >= columns.
struct Eliminated {
  Eigen::MatrixXd upper;   // of columns
  Eigen::MatrixXd beside;  // others, in the rows of the triangle
  Eigen::MatrixXd below;   // others, in the rows without columns
};
Eliminated eliminated(const Eigen::MatrixXd& columns, const Eigen::MatrixXd& others);

// Returns R^-1 for R of rows = QR.
Eigen::MatrixXd inverseOfUpper(const Eigen::MatrixXd& upper);

// Orthonormal columns with the same span as those of a tall matrix with independent columns.
Eigen::MatrixXd orthonormalColumns(const Eigen::MatrixXd& columns);

// Orthonormal columns that complete a unit vector to a basis: n x (n - 1).
Eigen::MatrixXd complementOf(const Eigen::VectorXd& direction);

// Solves matrix * x = right for a square matrix, with full pivoting.
Eigen::MatrixXd solveSquare(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right);

// The same; nothing when a pivot is at most threshold times the largest (without one: the rounding of the matrix).
std::optional<Eigen::MatrixXd> solveInvertible(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& right,
                                               std::optional<double> threshold = std::nullopt);
// Both for one right-hand side.
Eigen::VectorXd solutionOf(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right);
std::optional<Eigen::VectorXd> solutionIfInvertible(const Eigen::MatrixXd& matrix, const Eigen::VectorXd& right);

// Solves normal * x = right for a symmetric positive semidefinite matrix, such as J'J (LDL').
Eigen::MatrixXd solveCholesky(const Eigen::MatrixXd& normal, const Eigen::MatrixXd& right);

// Returns L of covariance = LL' for a positive definite covariance.
Eigen::MatrixXd lowerCholesky(const Eigen::MatrixXd& covariance);

// True of a symmetric matrix whose eigenvalues are all above zero.
bool isPositiveDefinite(const Eigen::MatrixXd& symmetric);

// Inverts a regular square matrix.
Eigen::MatrixXd inverse(const Eigen::MatrixXd& matrix);
Matrix6d inverse(const Matrix6d& matrix);
Eigen::Matrix3d inverse(const Eigen::Matrix3d& matrix);
Eigen::Matrix2d inverse(const Eigen::Matrix2d& matrix);

// The same; nothing for a singular matrix.
std::optional<Eigen::MatrixXd> inverseIfRegular(const Eigen::MatrixXd& matrix);

// Pseudoinverse of Moore and Penrose.
Eigen::MatrixXd pseudoInverse(const Eigen::MatrixXd& matrix);

double determinant(const Eigen::MatrixXd& matrix);

// Singular values, greatest first.
Eigen::VectorXd singularValues(const Eigen::MatrixXd& matrix);

// matrix = left * diag(values) * right', values greatest first.
struct SingularSystem {
  Eigen::VectorXd values;
  Eigen::MatrixXd left;
  Eigen::MatrixXd right;
};
SingularSystem singularSystem(const Eigen::MatrixXd& matrix);

// Eigenvalues of a symmetric matrix, least first.
Eigen::VectorXd symmetricEigenvalues(const Eigen::MatrixXd& matrix);

// With their vectors, as columns of length 1.
struct SymmetricEigen {
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};
SymmetricEigen symmetricEigen(const Eigen::MatrixXd& matrix);

}  // namespace probebox::metrology
