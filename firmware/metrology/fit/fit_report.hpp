#pragma once
#include <Eigen/Core>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"

namespace probebox::metrology {

// Turns one fit into a Result: what every method tells about it, and any number of quantities that follow from its
// parameters, each with the sd that follows too. The sd comes from the stated sigma, and grows with a warning where the
// residuals are worse than that by more than 4 deviations of their sum; without a stated sigma it comes from the
// residuals; where there are none, it is missing with a warning.
class Answer {
 public:
  // fit: its residuals are in units of sigma.value.
  Answer(const Dataset& dataset, const Fit& fit, const Sigma& sigma);

  // values: what is promised; jacobian: d values / d parameters, one row a value.
  void promiseScalar(std::string key, double value, const Eigen::RowVectorXd& jacobian);
  void promiseVector(std::string key, const Eigen::VectorXd& values, const Eigen::MatrixXd& jacobian);
  void promiseMatrix(std::string key, std::size_t columns, const Eigen::VectorXd& values,
                     const Eigen::MatrixXd& jacobian);
  // The same for what was found on the way.
  void alsoScalar(std::string key, double value, const Eigen::RowVectorXd& jacobian);
  void alsoVector(std::string key, const Eigen::VectorXd& values, const Eigen::MatrixXd& jacobian);
  void alsoMatrix(std::string key, std::size_t columns, const Eigen::VectorXd& values, const Eigen::MatrixXd& jacobian);
  void warn(std::string sentence);

  // Where the readings stand, for a picture of the residuals: `parts` rows of the fit to each row of the table, in the
  // order of the table; `against` is a column of it. sense: +1 where the fit's residual is read minus fitted, -1
  // (linear fits) where it is the other way round.
  void readings(const Table& table, std::span<const std::string_view> parts, std::string_view against,
                double sense = -1.0);
  // The same for a linear fit whose rows come from several tables.
  void readings(const std::vector<std::string>& names, const std::vector<double>& at, std::string_view against);
  // What one reading is, and its unit, where it is not one coordinate in mm.
  void readingIs(std::string what, std::string unit);

  // With the covariance of all promised values when that is wanted.
  Result take(bool with_covariance) &&;
  Result& result() { return result_; }

  // The sd of one reading: the stated one, widened where the residuals are worse, or that of the residuals; nothing
  // where nobody knows it.
  std::optional<double> readingSd() const { return reading_sd_; }
  // The sd of a combination of the parameters.
  std::optional<double> sdOf(const Eigen::RowVectorXd& jacobian) const;

 private:
  std::vector<double> sdsOf(const Eigen::MatrixXd& jacobian) const;
  Estimate with(Estimate estimate, const Eigen::MatrixXd& jacobian) const;
  void remember(const std::string& key, Shape shape, std::size_t columns, const Eigen::MatrixXd& jacobian);

  Result result_;
  Eigen::MatrixXd covariance_;  // of the parameters; empty when it is unknown
  Eigen::MatrixXd cofactor_;    // of the parameters, for readings of unit sigma
  Eigen::VectorXd residuals_;   // as fitted, in the unit of the readings
  std::vector<std::size_t> dropped_;
  std::optional<double> reading_sd_;
  Eigen::MatrixXd promised_;  // rows of the promised values
  std::vector<std::string> components_;
};

// Rows of the identity: picks `count` parameters from `first` on out of `of`.
Eigen::MatrixXd pick(Eigen::Index first, Eigen::Index count, Eigen::Index of);

}  // namespace probebox::metrology
