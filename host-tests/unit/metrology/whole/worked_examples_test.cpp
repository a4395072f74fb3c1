// The worked examples of the sources, to the digits that they print.
#include <Eigen/Geometry>
#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/metrology/features/sphere_fit.hpp"
#include "firmware/metrology/fit/sphere.hpp"
#include "firmware/metrology/touch/gain_matrix.hpp"
#include "firmware/metrology/touch/retract.hpp"
#include "firmware/metrology/touch/size_line.hpp"

namespace probebox::metrology {
namespace {

using testing::DoubleNear;

TEST(WorkedExample, GainMatrixFromTouchesAlongTheAxes) {
  Eigen::Matrix3d truth;
  truth << .98, .01, -.005, -.012, 1.03, .004, .006, -.008, 1.01;
  const Eigen::MatrixX3d velocities = 25.0 * Eigen::Matrix3d::Identity();
  Eigen::MatrixX3d slopes{3, 3};
  slopes << -25.506405, -.297741, .149165, .246647, -24.268219, -.193689, -.127246, .094638, -24.750970;
  const auto gain = gainMatrix(velocities, slopes);
  ASSERT_TRUE(gain.ok());
  EXPECT_TRUE(gain->isApprox(truth, 1e-7)) << gain.value();
}

TEST(WorkedExample, GainMatrixNeedsThreeDirections) {
  Eigen::MatrixX3d slopes{3, 3};
  slopes << -25, 0, 0, 0, -25, 0, -10, -10, 0;
  EXPECT_EQ(gainMatrix(-slopes, slopes).error().name, "dependent-directions");
  EXPECT_EQ(gainMatrix(-slopes.topRows(2), slopes.topRows(2)).error().name, "too-few-readings");
}

TEST(WorkedExample, RetractIsExtrapolatedToZeroDeflection) {
  const std::array<double, 4> t{.100, .104, .108, .112};
  Rows3 deflection = Rows3::Zero(4, 3);
  Rows3 position = Rows3::Zero(4, 3);
  deflection.col(0) << .343, .245, .147, .049;
  position.col(0) << 15.05375, 15.15375, 15.25375, 15.35375;
  const Line probe = fitLine(t, deflection);
  const Line machine = fitLine(t, position);
  EXPECT_NEAR(separationTime(probe), .114000, 1e-12);
  EXPECT_NEAR(machine.slope.x(), 25.0, 1e-9);
  EXPECT_NEAR(separationPoint(machine, probe).x(), 15.403750, 1e-9);
}

TEST(WorkedExample, DelayFromSizesAtFiveSpeeds) {
  const std::array<double, 5> speeds{5, 10, 20, 30, 40};
  const std::array<double, 5> diameters{30.9638, 30.9248, 30.8481, 30.7706, 30.6942};
  std::vector<SizeAtSpeed> retract;
  std::vector<SizeAtSpeed> approach;
  for (std::size_t k = 0; k < 5; ++k) {
    retract.push_back({2.0 * speeds[k], diameters[k], 1e-8});
    approach.push_back({-2.0 * speeds[k], 62.0 - diameters[k], 1e-8});
  }
  const auto line = fitSizeLine(retract);
  ASSERT_TRUE(line.ok());
  EXPECT_NEAR(line->size_mm, 31.002064024, 5e-10);
  EXPECT_NEAR(line->tau_s, .003851524390, 5e-13);
  // On approach an external feature measures larger by as much.
  EXPECT_NEAR(fitSizeLine(approach)->tau_s, line->tau_s, 1e-12);
}

TEST(WorkedExample, SizesNeedSpeedsThatDiffer) {
  const auto refusal = [](double first, double second) {
    const std::array<SizeAtSpeed, 2> sizes{SizeAtSpeed{first, 30.9, 1.0}, SizeAtSpeed{second, 30.8, 1.0}};
    return fitSizeLine(sizes).error().name;
  };
  EXPECT_EQ(refusal(50.0, 50.0), "single-speed");
  EXPECT_EQ(refusal(50.0, 41.0), "speeds-too-close");
}

Rows3 fivePoints() {
  Rows3 points{5, 3};
  points << 22.501, -20, 30, -2.4995, -20, 30, 10, -7.499, 30, 10, -32.5005, 30, 10, -20, 42.5015;
  return points;
}

TEST(WorkedExample, SphereThroughFivePoints) {
  const auto fit = fitSphere(fivePoints(), {});
  ASSERT_TRUE(fit.ok());
  EXPECT_THAT(std::vector<double>(fit->parameters.begin(), fit->parameters.end()),
              testing::ElementsAre(DoubleNear(10.000749985, 1e-9), DoubleNear(-19.999749995, 1e-9),
                                   DoubleNear(30.000999973, 1e-9), DoubleNear(12.500500052, 1e-9)));
  const Eigen::VectorXd sd = fit->cofactor.diagonal().cwiseSqrt();
  EXPECT_NEAR(sd[0], .7071, 1e-3);
  EXPECT_NEAR(sd[1], .7071, 1e-3);
  EXPECT_NEAR(sd[2], 1.1180, 1e-3);
}

TEST(WorkedExample, SphereOfKnownRadius) {
  const auto fit = fitSphere(fivePoints(), {.radius = 12.5});
  ASSERT_TRUE(fit.ok());
  EXPECT_NEAR(fit->parameters[2], 30.001499785, 1e-9);
  EXPECT_NEAR(std::sqrt(fit->cofactor(2, 2)), 1.0, 1e-3);
}

}  // namespace
}  // namespace probebox::metrology
