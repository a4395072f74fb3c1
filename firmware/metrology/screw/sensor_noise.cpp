#include "firmware/metrology/screw/sensor_noise.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {

double inflationBy(const Eigen::VectorXd& residuals) {
  const Eigen::Index n = residuals.size();
  const double squares = residuals.squaredNorm();
  if (!(squares > 0)) return 1;
  const double r = residuals.head(n - 1).dot(residuals.tail(n - 1)) / squares;
  return r > 2 / std::sqrt(static_cast<double>(n)) ? (1 + r) / (1 - std::min(r, 0.999)) : 1;
}

void inflate(Result& result, double inflation) {
  for (auto& estimate : result.estimates) {
    for (double& sd : estimate.sd) sd *= std::sqrt(inflation);
  }
  if (!result.covariance) return;
  for (double& value : result.covariance->values) value *= inflation;
}

std::string correlatedWarning(double inflation) {
  return "neighbouring readings are correlated, as of a sensor with a time constant: the standard deviations are " +
         text(std::sqrt(inflation)) + " times those of independent readings";
}

}  // namespace probebox::metrology
