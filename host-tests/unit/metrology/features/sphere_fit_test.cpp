#include "firmware/metrology/features/sphere_fit.hpp"

#include <Eigen/LU>
#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

#include "firmware/metrology/solve.hpp"
#include "host-tests/metrology/moments.hpp"
#include "host-tests/metrology/touched_features.hpp"

namespace probebox::metrology {
namespace {

using testing::AllOf;
using testing::Gt;
using testing::HasSubstr;
using testing::Lt;

TEST(SphereFit, ReachesTheCramerRaoBoundAndSaysSo) {
  std::mt19937_64 random{1};
  Moments normalised;
  Moments radius;
  double bounds = 0.0;
  double squares = 0.0;
  double chi2 = 0.0;
  constexpr int kTrials = 1000;
  for (int trial = 0; trial < kTrials; ++trial) {
    const Ball ball = randomBall(random);
    const double sigma = uniform(random, 1e-4, 3e-3);
    const auto solved = solve(touched(ball, sigma, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    Eigen::Matrix4d information = Eigen::Matrix4d::Zero();
    for (const auto& n : ball.normals) {
      const Eigen::Vector4d row{-n.x(), -n.y(), -n.z(), -1.0};
      information += row * row.transpose() / (sigma * sigma);
    }
    const Eigen::Matrix4d bound = information.inverse();
    const auto& centre = *solved->find("centre_mm");
    for (std::size_t k = 0; k < 3; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      const double error = centre.values[k] - ball.centre[at];
      normalised.add(error, centre.sd[k]);
      squares += error * error / bound(at, at);
      ++bounds;
    }
    radius.add(solved->find("radius_mm")->value() - ball.radius, solved->find("radius_mm")->sd[0]);
    chi2 += *solved->chi2_reduced / kTrials;
  }
  EXPECT_THAT(bounds / squares, AllOf(Gt(0.93), Lt(1.08)));
  expectHonest(normalised);
  expectHonest(radius);
  EXPECT_THAT(chi2, AllOf(Gt(0.94), Lt(1.06)));
}

TEST(SphereFit, IsExactWithoutNoise) {
  std::mt19937_64 random{2};
  for (int trial = 0; trial < 50; ++trial) {
    const Ball ball = randomBall(random);
    const auto solved = solve(touched(ball, 0.0, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_NEAR(solved->find("radius_mm")->value(), ball.radius, 1e-10);
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(solved->find("centre_mm")->values[k], ball.centre[static_cast<Eigen::Index>(k)], 1e-10);
    }
  }
}

TEST(SphereFit, TakesTheResidualsWhereNoSigmaIsStated) {
  std::mt19937_64 random{3};
  Moments pull;
  for (int trial = 0; trial < 500; ++trial) {
    const Ball ball = randomBall(random);
    Dataset dataset = touched(ball, 0.002, random);
    dataset.config.clear();
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok());
    EXPECT_EQ(solved->dof, 6U);
    pull.add(solved->find("centre_mm")->values[0] - ball.centre.x(), solved->find("centre_mm")->sd[0]);
  }
  EXPECT_THAT(pull.pull(), AllOf(Gt(0.75), Lt(1.35))) << "an sd of Student's t with 6 degrees of freedom";
}

TEST(SphereFit, HasNoSdWithoutSigmaAndWithoutResiduals) {
  std::mt19937_64 random{4};
  Ball ball = randomBall(random);
  ball.normals = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  Dataset dataset = touched(ball, 0.001, random);
  dataset.config.clear();
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok());
  EXPECT_TRUE(solved->find("centre_mm")->sd.empty());
  EXPECT_THAT(solved->warnings, testing::Contains(HasSubstr("no sd")));
}

TEST(SphereFit, NeedsOnlyThreePointsOfAKnownSphereOnAKnownSide) {
  std::mt19937_64 random{5};
  Ball ball = randomBall(random);
  ball.normals = {{0.8, 0, 0.6}, {-0.8, 0, 0.6}, {0, 0.8, 0.6}};
  Dataset dataset = touched(ball, 0.0, random);
  dataset.config["radius_mm"] = ball.radius;
  EXPECT_EQ(solve(dataset).error().name, "coplanar");
  dataset.config["approximate_centre_mm"] =
      std::vector<double>{ball.centre.x() + 0.3, ball.centre.y(), ball.centre.z() - 0.3};
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("centre_mm")->values[2], ball.centre.z(), 1e-9);
  EXPECT_EQ(solved->find("radius_mm"), nullptr);
}

TEST(SphereFit, DropsAGrossErrorByNameWhenAsked) {
  std::mt19937_64 random{6};
  const Ball ball = randomBall(random);
  Dataset dataset = touched(ball, 0.001, random);
  dataset.tables[0].columns[2].values[6] += 0.3;
  EXPECT_EQ(solve(dataset).error().name, "residual-too-large");
  dataset.config["robust"] = true;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok());
  ASSERT_THAT(solved->dropped, testing::Not(testing::IsEmpty()));
  EXPECT_THAT(solved->dropped, testing::Contains(testing::Field(&Dropped::name, "point 7")));
  EXPECT_NEAR(solved->find("centre_mm")->values[0], ball.centre.x(), 0.01);
}

// A thousand honest points have one beyond 4 sigma in one table of fifteen, ten thousand in every second one.
TEST(SphereFit, RefusesNoHonestTableOfManyPoints) {
  std::mt19937_64 random{7};
  for (const std::size_t points : {200U, 2000U, 20'000U}) {
    Ball ball = randomBall(random);
    while (ball.normals.size() < points) {
      const Eigen::Vector3d normal{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)};
      ball.normals.push_back(normal.normalized());
    }
    for (int trial = 0; trial < 10; ++trial) {
      Dataset dataset = touched(ball, 0.001, random);
      const auto solved = solve(dataset);
      EXPECT_TRUE(solved.ok()) << points << " points: " << solved.error().reason;
      dataset.tables[0].columns[2].values[6] += 0.008 / std::abs(ball.normals[6].z());
      EXPECT_EQ(solve(dataset).error().name, "residual-too-large");
    }
  }
}

TEST(SphereFit, NamesTheFirstPairOfCopies) {
  std::mt19937_64 random{8};
  Dataset dataset = touched(randomBall(random), 0.001, random);
  for (auto& column : dataset.tables[0].columns) {
    column.values[9] = column.values[2];
    column.values[5] = column.values[4];
    column.values[7] = column.values[2];
  }
  const auto refused = solve(dataset);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().name, "duplicated-reading");
  EXPECT_THAT(refused.error().reason, AllOf(HasSubstr("points 3"), HasSubstr("and 8")));
}

}  // namespace
}  // namespace probebox::metrology
