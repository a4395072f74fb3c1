#pragma once
#include <Eigen/Core>
#include <string>

#include "firmware/metrology/dataset/result.hpp"

// Noise of a screw's sensor with a time constant: readings that follow each other are correlated.
namespace probebox::metrology {

// Factor on the variance of a mean: (1 + r) / (1 - r), r the correlation of neighbours; 1 where chance explains r.
// residuals: in the order of time.
double inflationBy(const Eigen::VectorXd& residuals);

// Multiplies every variance and covariance of the promised values.
void inflate(Result& result, double inflation);

// The sentence about a factor above 1.
std::string correlatedWarning(double inflation);

}  // namespace probebox::metrology
