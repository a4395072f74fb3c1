#pragma once
#include <Eigen/Core>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/least_squares.hpp"

// Noise of a screw's sensor with a time constant, and of its converter: readings that follow each other are correlated.
namespace probebox::metrology {

// Finds by how much less the noise averages out than that of independent readings, from the squares of sums of
// residuals over blocks of neighbours (D7). Each is compared with what the fit leaves of independent readings.
class SensorNoise {
 public:
  // design: that of the fit, one row a reading, in the order of time. Both must outlive this.
  SensorNoise(const Fit& fit, const Eigen::MatrixXd& design) : fit_{fit}, design_{design} {}

  // Factor on the variance of a mean or a drift over all readings, as white noise and noise with one time constant
  // explain blocks of different lengths; 1 where chance explains them.
  double ofAll() const;
  // Factor on the variance of means over stretches of neighbours, which lie apart from each other in time. ends: one
  // past the last reading of every stretch, rising. of_all: the factor above.
  double ofStretches(const std::vector<Eigen::Index>& ends, double of_all) const;

 private:
  struct Blocks {
    double ratio{1};   // of the squares of sums to those of independent readings
    double count{};    // free sums
    double length{1};  // mean
    double excess{};   // kurtosis of a residual
    bool isClear() const;
  };
  Blocks over(const std::vector<Eigen::Index>& ends) const;
  double ofNeighbours() const;

  const Fit& fit_;
  const Eigen::MatrixXd& design_;
};

// Multiplies the variances of one promised value, and its covariances by the root.
void inflate(Result& result, std::string_view key, double inflation);

// The sentence about factors above 1. times: on the standard deviations.
std::string correlatedWarning(const std::string& times);

}  // namespace probebox::metrology
