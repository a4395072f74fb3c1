// Centre of rotation of one feature, against readings of a point that is turned about a centre.
#include "firmware/metrology/centreline/centreline.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <rapidcheck/gtest.h>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/fisher.hpp"
#include "host-tests/metrology/turned_feature.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;
using testing::AllOf;
using testing::Gt;
using testing::Lt;

// Farther apart than kSameStop_rad, so that each is a stop of its own in whatever order they come.
std::vector<double> randomAngles(std::mt19937_64& random) {
  const double arc = uniform(random, 1.0, 2.0 * std::numbers::pi);
  std::vector<double> angles;
  const int n = std::uniform_int_distribution<int>{3, 15}(random);
  const double by = std::min(0.05, 0.4 * arc / n);
  for (int k = 0; k < n; ++k) angles.push_back(arc * k / n + uniform(random, -by, by));
  return angles;
}

TEST(Centreline, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{1};
  Judgement judgement;
  for (int trial = 0; trial < 800; ++trial) {
    const Vector2d centre{uniform(random, -1, 1), uniform(random, -1, 1)};
    const Vector2d arm{uniform(random, 5, 60), uniform(random, -40, 40)};
    const auto angles = randomAngles(random);
    const double sigma = uniform(random, 2e-4, 5e-3);
    const auto solved = solve(centrelineDataset(turnedFeature(centre, arm, angles, sigma, 0.0, random), sigma));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const VectorXd truth = (VectorXd{4} << centre, arm).finished();
    const auto covariance = smallestCovariance(
        [&](const VectorXd& p) {
          VectorXd values{static_cast<Eigen::Index>(2 * angles.size())};
          for (std::size_t k = 0; k < angles.size(); ++k) {
            values.segment<2>(static_cast<Eigen::Index>(2 * k)) =
                p.head<2>() + Eigen::Rotation2Dd{angles[k]} * p.tail<2>();
          }
          return values;
        },
        truth, sigma);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      judgement.add(solved->find("centre_mm")->values[k] - centre[at], solved->find("centre_mm")->sd[k],
                    std::sqrt(covariance(at, at)));
    }
  }
  expectHonest(judgement);
}

// With every angle's own error as one more unknown, held by the noise of the axis.
TEST(Centreline, ReachesTheBoundWithNoiseOfTheAngle) {
  std::mt19937_64 random{2};
  Judgement judgement;
  Judgement unweighted;
  for (int trial = 0; trial < 500; ++trial) {
    const Vector2d centre{uniform(random, -1, 1), uniform(random, -1, 1)};
    const Vector2d arm{uniform(random, 100, 800), uniform(random, -400, 400)};
    const auto angles = randomAngles(random);
    const double sigma = uniform(random, 5e-4, 2e-3);
    const double sigma_angle = std::pow(10.0, uniform(random, -6.0, -4.0));
    const auto n = static_cast<Eigen::Index>(angles.size());
    auto dataset = centrelineDataset(turnedFeature(centre, arm, angles, sigma, sigma_angle, random), sigma);
    const auto simple = solve(dataset);
    dataset.config["sigma_C_rad"] = sigma_angle;
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const VectorXd truth = (VectorXd{4 + n} << centre, arm, VectorXd::Zero(n)).finished();
    const auto covariance = smallestCovariance(
        [&](const VectorXd& p) {
          VectorXd values{3 * n};
          for (Eigen::Index k = 0; k < n; ++k) {
            const double angle = angles[static_cast<std::size_t>(k)] + p[4 + k] * sigma_angle / sigma;
            values.segment<2>(2 * k) = p.head<2>() + Eigen::Rotation2Dd{angle} * p.segment<2>(2);
            values[2 * n + k] = p[4 + k];
          }
          return values;
        },
        truth, sigma);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      const double bound = std::sqrt(covariance(at, at));
      judgement.add(solved->find("centre_mm")->values[k] - centre[at], solved->find("centre_mm")->sd[k], bound);
      unweighted.add(simple->find("centre_mm")->values[k] - centre[at], 1.0, bound);
    }
  }
  expectHonest(judgement);
  EXPECT_LT(unweighted.efficiency(), 0.5) << "the weights must matter here";
}

// Repeats at one stop share what the stop is off.
TEST(Centreline, CountsTheErrorOfAStopOnceWhereReadingsAreRepeated) {
  std::mt19937_64 random{32};
  Moments errors;
  for (int trial = 0; trial < 600; ++trial) {
    const Vector2d centre{uniform(random, -1, 1), uniform(random, -1, 1)};
    const Vector2d arm{uniform(random, 100, 800), uniform(random, -400, 400)};
    const double sigma = uniform(random, 5e-4, 2e-3);
    const double sigma_angle = 4.0 * sigma / arm.norm();
    std::vector<RotationReading> readings;
    for (const double angle : {0.0, 1.1, 2.3, 4.0}) {
      const double real = angle + gauss(random, sigma_angle);
      for (int k = 0; k < 5; ++k) {
        auto reading = turnedFeature(centre, arm, {real}, sigma, 0.0, random).front();
        reading.angle = angle;
        readings.push_back(reading);
      }
    }
    auto dataset = centrelineDataset(readings, sigma);
    dataset.config["sigma_C_rad"] = sigma_angle;
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto& found = *solved->find("centre_mm");
    for (std::size_t k = 0; k < 2; ++k) {
      errors.add(found.values[k] - centre[static_cast<Eigen::Index>(k)], found.sd[k]);
    }
  }
  expectHonest(errors, 600);
}

TEST(Centreline, GivesTheWorkedExamples) {
  const std::vector<RotationReading> two{{{21.25, 4.25}, 0.0},
                                         {{1.596751771, 19.862611751}, 75.0 * std::numbers::pi / 180.0}};
  const auto first = solve(centrelineDataset(two, 0.001));
  EXPECT_NEAR(first->find("centre_mm")->values[0], 1.25, 1e-8);
  EXPECT_NEAR(first->find("centre_mm")->values[1], -0.75, 1e-8);
  // (B5): sd is sigma / (sqrt2 |sin(alpha/2)|).
  EXPECT_NEAR(first->find("centre_mm")->sd[0], 0.001 / std::numbers::sqrt2 / std::sin(37.5 * std::numbers::pi / 180.0),
              1e-12);

  const std::vector<RotationReading> three{{{21.251, 4.248}, 0.0},
                                           {{13.357450814, 15.936974409}, 40.0 * std::numbers::pi / 180.0},
                                           {{-7.148502318, 18.078414172}, 100.0 * std::numbers::pi / 180.0}};
  const auto second = solve(centrelineDataset(three, 0.001));
  EXPECT_NEAR(second->find("centre_mm")->values[0], 1.248769855, 1e-8);
  EXPECT_NEAR(second->find("centre_mm")->values[1], -0.751509719, 1e-8);
  EXPECT_NEAR(second->find("arm_mm")->values[0], 20.002398259, 1e-8);
  EXPECT_NEAR(second->find("arm_mm")->values[1], 5.000078977, 1e-8);
}

// (B5) as printed, for any two angles.
RC_GTEST_PROP(Centreline, OfTwoReadingsIsThePrintedFormula, ()) {
  const double alpha = *rc::gen::inRange(7, 353) * std::numbers::pi / 180.0;
  const Vector2d p1{*rc::gen::inRange(-100, 100) / 4.0, *rc::gen::inRange(-100, 100) / 4.0};
  const Vector2d p2{*rc::gen::inRange(-100, 100) / 4.0 + 0.1, *rc::gen::inRange(-100, 100) / 4.0};
  RC_PRE((p2 - p1).norm() > 1);  // a feature that hardly moves is refused
  const auto solved = solve(centrelineDataset({{p1, 0.3}, {p2, 0.3 + alpha}}, 0.0));
  const Vector2d half = (p2 - p1) / (2.0 * std::tan(alpha / 2.0));
  const Vector2d centre = (p1 + p2) / 2.0 + Vector2d{-half.y(), half.x()};
  RC_ASSERT(solved.ok());
  RC_ASSERT(std::abs(solved->find("centre_mm")->values[0] - centre.x()) < 1e-9);
  RC_ASSERT(std::abs(solved->find("centre_mm")->values[1] - centre.y()) < 1e-9);
}

// The set-up is moved, turned, magnified; the rows change places: the centre goes with it and its sd with the scale.
RC_GTEST_PROP(Centreline, GoesWithTheSetUp, ()) {
  std::mt19937_64 random{*rc::gen::arbitrary<std::uint64_t>()};
  const double sigma_angle = *rc::gen::element(0.0, 2e-5);
  auto readings = turnedFeature({0.3, -0.2}, {25, 10}, randomAngles(random), 0.001, sigma_angle, random);
  const Vector2d shift{uniform(random, -300, 300), uniform(random, -300, 300)};
  const Eigen::Rotation2Dd rotation{uniform(random, -3, 3)};
  const double scale = uniform(random, 0.1, 30.0);
  const double offset = uniform(random, -7, 7);
  auto dataset = centrelineDataset(readings, 0.001);
  dataset.config["sigma_C_rad"] = sigma_angle;
  const auto before = solve(dataset);
  for (auto& reading : readings) {
    reading = {shift + scale * (rotation * reading.at), reading.angle + offset};
  }
  std::ranges::shuffle(readings, random);
  dataset = centrelineDataset(readings, 0.001 * scale);
  dataset.config["sigma_C_rad"] = sigma_angle;
  const auto after = solve(dataset);
  RC_ASSERT(before.ok() && after.ok());
  const auto& c = *before->find("centre_mm");
  const auto& d = *after->find("centre_mm");
  const Vector2d expected = shift + scale * (rotation * Vector2d{c.values[0], c.values[1]});
  RC_ASSERT((expected - Vector2d{d.values[0], d.values[1]}).norm() < 1e-8 * (1.0 + scale));
  RC_ASSERT(std::abs(std::hypot(d.sd[0], d.sd[1]) / std::hypot(c.sd[0], c.sd[1]) / scale - 1.0) < 1e-5);
  RC_ASSERT(std::abs(*before->chi2_reduced - *after->chi2_reduced) < 1e-4 * (1.0 + *before->chi2_reduced));
}

TEST(Centreline, FollowsTheSenseOfTheAxis) {
  std::mt19937_64 random{3};
  auto readings = turnedFeature({0.3, -0.2}, {25, 10}, {0.0, 1.0, 2.5, 4.0}, 0.0, 0.0, random);
  for (auto& reading : readings) reading.angle = -reading.angle;
  Dataset dataset = centrelineDataset(readings, 0.001);
  dataset.config["C_sense"] = -1.0;
  EXPECT_NEAR(solve(dataset)->find("centre_mm")->values[0], 0.3, 1e-9);
}

TEST(Centreline, TakesTheResidualsWhereNoSigmaIsStated) {
  std::mt19937_64 random{4};
  Moments pull;
  for (int trial = 0; trial < 400; ++trial) {
    const auto solved =
        solve(centrelineDataset(turnedFeature({0, 0}, {20, 0}, {0, 1, 2, 3, 4, 5}, 0.002, 0.0, random), 0.0));
    EXPECT_EQ(solved->dof, 8U);
    EXPECT_FALSE(solved->chi2_reduced.has_value());
    pull.add(solved->find("centre_mm")->values[0], solved->find("centre_mm")->sd[0]);
  }
  EXPECT_THAT(pull.pull(), AllOf(Gt(0.75), Lt(1.3))) << "an sd of Student's t with 8 degrees of freedom";
  const auto exact = solve(centrelineDataset(turnedFeature({0, 0}, {20, 0}, {0, 3}, 0.0, 0.0, random), 0.0));
  EXPECT_TRUE(exact->find("centre_mm")->sd.empty());
  EXPECT_THAT(exact->warnings, testing::Contains(testing::HasSubstr("no sd")));
}

TEST(Centreline, WidensAndSaysSoWhereTheReadingsDisagree) {
  std::mt19937_64 random{5};
  auto readings = turnedFeature({0, 0}, {20, 0}, {0, 1, 2, 3, 4, 5}, 0.001, 0.0, random);
  for (std::size_t k = 0; k < readings.size(); ++k) readings[k].at.x() += k % 3 == 0 ? 0.03 : -0.02;
  const auto solved = solve(centrelineDataset(readings, 0.001));
  EXPECT_GT(solved->find("centre_mm")->sd[0], 0.005);
  EXPECT_THAT(solved->warnings, testing::Contains(testing::HasSubstr("scatter more")));
}

TEST(Centreline, RefusesByName) {
  std::mt19937_64 random{6};
  const auto refusal = [&](const std::vector<double>& angles) {
    return refusalOf(centrelineDataset(turnedFeature({0, 0}, {20, 3}, angles, 0.001, 0.0, random), 0.001));
  };
  EXPECT_EQ(refusal({0.0}), "too-few-readings");
  EXPECT_EQ(refusal({1.0, 1.0}), "angles-too-close");
  EXPECT_EQ(refusal({0.0, 2.0 * std::numbers::pi}), "angles-too-close");
  EXPECT_EQ(refusal({0.0, 5.7 * std::numbers::pi / 180.0}), "angles-too-close");
  EXPECT_EQ(refusal({0.0, 5.8 * std::numbers::pi / 180.0}), "");
  EXPECT_EQ(refusal({0.0, 0.02, 0.04, 0.06}), "angles-too-close");
  EXPECT_EQ(refusal({0.0, 0.0, 0.0}), "angles-too-close");
  auto dataset = centrelineDataset(turnedFeature({0, 0}, {20, 3}, {0.0, 3.0}, 0.001, 0.0, random), 0.001);
  EXPECT_THAT(solve(dataset)->warnings, testing::ElementsAre(testing::StartsWith("no-redundancy")));
  dataset.config["sigma_mm"] = -0.001;
  EXPECT_EQ(refusalOf(dataset), "bad-config");
  dataset.config["sigma_mm"] = std::string{"fine"};
  EXPECT_EQ(refusalOf(dataset), "bad-config");
  const auto near = solve(centrelineDataset(turnedFeature({0, 0}, {20, 3}, {0.0, 0.3}, 0.001, 0.0, random), 0.001));
  EXPECT_THAT(near->warnings, testing::Contains(testing::HasSubstr("close together")));
}

}  // namespace
}  // namespace probebox::metrology
