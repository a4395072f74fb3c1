#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"

namespace probebox::metrology {

// Most numbers of one value whose covariances are told.
inline constexpr Eigen::Index kMostInCovariance = 60;

// Turns a fit into a Result: quality figures and any number of quantities derived from its parameters, with propagated
// sd. The sd follows from the stated sigma and is widened, with a warning, where chi-square contradicts it
// (noise_check.hpp); without one it follows from the residuals (chi_square.hpp); where those are too few it is missing,
// with a warning.
class Answer {
 public:
  // fit: its residuals are in units of sigma.value.
  Answer(const Dataset& dataset, const Fit& fit, const Sigma& sigma);

  // values: promised; jacobian: d values / d parameters, one row per value.
  void promiseScalar(std::string_view key, double value, const Eigen::RowVectorXd& jacobian);
  void promiseVector(std::string_view key, const Eigen::VectorXd& values, const Eigen::MatrixXd& jacobian);
  void promiseMatrix(std::string_view key, std::size_t columns, const Eigen::VectorXd& values,
                     const Eigen::MatrixXd& jacobian);
  // Adds a derived quantity that is not promised.
  void alsoScalar(std::string_view key, double value, const Eigen::RowVectorXd& jacobian);
  void alsoVector(std::string_view key, const Eigen::VectorXd& values, const Eigen::MatrixXd& jacobian);
  void alsoMatrix(std::string_view key, std::size_t columns, const Eigen::VectorXd& values,
                  const Eigen::MatrixXd& jacobian);
  // A quantity of more numbers than a covariance holds, by the roots of their cofactors (as Fit::cofactor).
  Estimate withRoots(Estimate estimate, const Eigen::VectorXd& roots) const;
  void warn(std::string sentence);

  // Assigns `parts` rows of the fit to each row of the table, in its order, for a plot of residuals over column
  // `against`. sense: +1 if the fit's residual is measured minus fitted, -1 (linear fits) if it is the opposite.
  void readings(const Table& table, const ColumnNames& parts, std::string_view against, double sense = -1.0);
  // Assigns rows of a linear fit that come from several tables.
  void readings(const std::vector<std::string>& names, const std::vector<double>& at, std::string_view against);
  // Name and unit of one reading, if it is not one coordinate in mm.
  void readingIs(std::string what, std::string unit);

  // Returns the result, with the covariance of all promised values if wanted.
  Result take(bool with_covariance) &&;
  Result& result() { return result_; }

  // Scatter of one reading: the stated sd, widened if the residuals are larger, or the root of the mean square of the
  // residuals; nullopt if unknown.
  std::optional<double> readingSd() const { return reading_sd_; }
  // sd of a linear combination of the parameters.
  std::optional<double> sdOf(const Eigen::RowVectorXd& jacobian) const;

 private:
  std::vector<double> sdsOf(const Eigen::MatrixXd& jacobian) const;
  Estimate with(Estimate estimate, const Eigen::MatrixXd& jacobian) const;
  void remember(std::string_view key, Shape shape, std::size_t columns, const Eigen::MatrixXd& jacobian);

  Result result_;
  Eigen::MatrixXd covariance_;  // of the parameters; empty if unknown
  Eigen::MatrixXd cofactor_;    // of the parameters, for readings of unit sigma
  Eigen::VectorXd residuals_;   // as fitted, in the unit of the readings
  std::vector<std::size_t> dropped_;
  std::optional<double> scale_;  // of the cofactor's roots; nothing if unknown
  double sigma_{};
  std::optional<double> reading_sd_;
  Eigen::MatrixXd promised_;  // rows of the promised values
  std::vector<std::string> components_;
};

// Rows of the identity: selects `count` parameters from `first` on out of `of`.
Eigen::MatrixXd pick(Eigen::Index first, Eigen::Index count, Eigen::Index of);

}  // namespace probebox::metrology
