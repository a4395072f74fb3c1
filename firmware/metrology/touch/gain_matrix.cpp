#include "firmware/metrology/touch/gain_matrix.hpp"

#include <string>

#include "firmware/metrology/fit/decompositions.hpp"

namespace probebox::metrology {

Outcome<Eigen::Matrix3d, Refusal> gainMatrix(const Eigen::MatrixX3d& velocities, const Eigen::MatrixX3d& slopes) {
  if (slopes.rows() < 3) {
    return Refusal{"too-few-readings", std::to_string(slopes.rows()) +
                                           " touches do not determine a gain matrix: touch in three directions"};
  }
  const Eigen::VectorXd singular = singularValues(slopes);
  if (!(singular[2] >= 1e-3 * singular[0])) {
    return Refusal{"dependent-directions",
                   "the touches deflect the probe in one plane only: touch in three independent directions"};
  }
  const Eigen::Matrix3d transposed = solveLeastSquares(slopes, -velocities);
  return Eigen::Matrix3d{transposed.transpose()};
}

}  // namespace probebox::metrology
