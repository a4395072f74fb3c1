#include "firmware/metrology/kinematics/joint_path.hpp"

#include <gtest/gtest.h>
#include <random>
#include <vector>

namespace probebox::metrology {
namespace {

constexpr int kSamples = 40;
constexpr double kNoise = 1e-4;

// A joint at this speed and acceleration, whose tip goes along X.
JointPath pathOf(double rate, double acceleration, std::mt19937_64& random) {
  std::normal_distribution<double> noise{0, kNoise};
  std::vector<double> times;
  Eigen::MatrixXd joints{kSamples, 1};
  Rows3 positions{kSamples, 3};
  for (int k = 0; k < kSamples; ++k) {
    const double t = 0.002 * k;
    times.push_back(t);
    joints(k, 0) = 3 + rate * t + acceleration / 2 * t * t + noise(random);
    positions.row(k) << 100 + 20 * t + noise(random), noise(random), noise(random);
  }
  return fitJointPath(times, joints, positions, fitLine(times, positions));
}

// A parabola through the noise of a straight path would make its rates at both ends ten times less certain.
TEST(JointPath, IsStraightWhereNoBendStandsOutOfTheNoise) {
  std::mt19937_64 random{7};
  int bent = 0;
  for (int run = 0; run < 400; ++run) bent += pathOf(2, 0, random).coefficients(0, 2) != 0 ? 1 : 0;
  EXPECT_LE(bent, 3);
}

TEST(JointPath, IsBentWhereTheJointGathersSpeed) {
  std::mt19937_64 random{7};
  const auto path = pathOf(2, 5, random);
  ASSERT_NE(path.coefficients(0, 2), 0);
  for (const double t : {0.01, 0.07}) EXPECT_NEAR(path.rates(Eigen::VectorXd::Constant(1, t))[0], 2 + 5 * t, 0.03);
}

}  // namespace
}  // namespace probebox::metrology
