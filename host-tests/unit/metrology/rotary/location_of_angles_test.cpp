// The place of a rotary axis by its errors at angles that do not begin at zero.
#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <vector>

#include "firmware/metrology/rotary/rotary_location.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;

// (E7): (I - R) d + b, with an error b of the reference angle.
TEST(LocationOfAngles, IsExactWhereEveryAngleHasErrors) {
  const std::vector<double> angles{0.4, 1.9, 3.1, 5.0};
  for (const Vector3d& direction : {Vector3d{0, 0, 1}, Vector3d{0, -1, 0}, Vector3d{0.6, 0, 0.8}}) {
    const Vector3d across = direction.unitOrthogonal(), b = 0.02 * across - 0.013 * direction.cross(across);
    const Vector3d d = 0.012 * across + 0.007 * direction.cross(across);
    for (const Index offset : {0, 3}) {
      Eigen::VectorXd six = Eigen::VectorXd::Zero(24);
      for (Index k = 0; k < 4; ++k) {
        const Matrix3d turned = Eigen::AngleAxisd{angles[static_cast<std::size_t>(k)], direction}.toRotationMatrix();
        six.segment<3>(6 * k + offset) = d - turned * d + b;
      }
      EXPECT_LT((locationMap(angles, direction, offset) * six - d).norm(), 1e-12);
      const std::vector blocks(4, Eigen::MatrixXd{Eigen::MatrixXd::Identity(6, 6)});
      const AngleErrors errors{angles, six, {blocks, blocks, Eigen::MatrixXd::Zero(6, 6)}};
      const auto motions = errorMotionsOf(errors, direction, offset);
      EXPECT_LT(motions.values.norm(), 1e-12);
      // Of unit cofactors: those of what is left of four angles after four unknowns across the axis and one along it.
      EXPECT_NEAR(motions.roots.squaredNorm(), 12 - 5, 1e-9);
    }
  }
}

}  // namespace
}  // namespace probebox::metrology
