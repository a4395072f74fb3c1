// A large chuck of which the probe reaches an arc: contacts found by root finding, readings by a turned ball.
#include "firmware/metrology/centreline/limited_access.hpp"

#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <rapidcheck/gtest.h>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/fisher.hpp"
#include "host-tests/metrology/large_chuck.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::VectorXd;
using testing::HasSubstr;

TEST(LimitedAccess, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{1};
  Judgement centre;
  Judgement rim;
  for (int trial = 0; trial < 600; ++trial) {
    const ReachedChuck chuck = randomReachedChuck(random);
    const double sigma = uniform(random, 3e-4, 3e-3);
    const double sigma_c = trial % 2 == 0 ? 0.0 : uniform(random, 1e-6, 2e-5);
    const auto angles = fiveAngles(uniform(random, 25, 50) * kDegree);
    const auto n = static_cast<Eigen::Index>(angles.size());
    const auto solved = solve(rimDataset(chuck, angles, sigma, sigma_c, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto covariance = smallestCovariance(
        [&](const VectorXd& p) {
          // p: centre, radius, psi (in mm at the rim), and the error of every angle in units of its own sigma.
          const ReachedChuck at{p.head<2>(), p[2], p[3] / 1000.0};
          VectorXd values{3 * n};
          for (Eigen::Index k = 0; k < n; ++k) {
            values.segment<2>(2 * k) = at.ball(angles[static_cast<std::size_t>(k)] + p[4 + k] * sigma_c / sigma);
            values[2 * n + k] = p[4 + k];
          }
          return values;
        },
        (VectorXd{4 + n} << chuck.centre, chuck.radius, chuck.psi * 1000.0, VectorXd::Zero(n)).finished(), sigma);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      centre.add(solved->find("centre_mm")->values[k] - chuck.centre[at], solved->find("centre_mm")->sd[k],
                 std::sqrt(covariance(at, at)));
    }
    rim.add(solved->find("radius_mm")->value() - chuck.radius, solved->find("radius_mm")->sd[0],
            std::sqrt(covariance(2, 2)));
    rim.add(solved->find("psi0_rad")->value() - chuck.psi, solved->find("psi0_rad")->sd[0],
            std::sqrt(covariance(3, 3)) / 1000.0);
  }
  expectHonest(centre);
  expectHonest(rim);
}

// A stop of C is off once, however often the ball is read there.
TEST(LimitedAccess, CountsTheErrorOfAStopOnceWhereReadingsAreRepeated) {
  std::mt19937_64 random{31};
  Moments x, y;
  for (int trial = 0; trial < 600; ++trial) {
    const ReachedChuck chuck = randomReachedChuck(random);
    const double sigma = uniform(random, 5e-4, 2e-3);
    const double sigma_c = uniform(random, 1.0, 6.0) * sigma / chuck.radius;
    const int repeats = 2 + trial % 6;
    Dataset dataset = rimDataset(chuck, {}, sigma, sigma_c, random);
    for (const double c : {-30.0, 0.0, 30.0, -15.0}) {
      const Vector2d at = chuck.ball(c * kDegree + gauss(random, sigma_c));
      for (int k = 0; k < repeats; ++k) {
        // A control reports its digits anew.
        dataset.tables[0].append(
            {c * kDegree + gauss(random, 1e-9), at.x() + gauss(random, sigma), at.y() + gauss(random, sigma)});
      }
    }
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto& centre = *solved->find("centre_mm");
    x.add(centre.values[0] - chuck.centre.x(), centre.sd[0]);
    y.add(centre.values[1] - chuck.centre.y(), centre.sd[1]);
  }
  expectHonest(x);
  expectHonest(y);
}

TEST(LimitedAccess, IsExactWithoutNoise) {
  std::mt19937_64 random{2};
  for (int trial = 0; trial < 50; ++trial) {
    const ReachedChuck chuck = randomReachedChuck(random);
    for (const double sigma_c : {0.0, 1e-5}) {
      Dataset dataset = rimDataset(chuck, fiveAngles(0.7), 0.0, 0.0, random);
      dataset.config["sigma_mm"] = 0.001;
      dataset.config["sigma_C_rad"] = sigma_c;
      const auto solved = solve(dataset);
      ASSERT_TRUE(solved.ok()) << solved.error().reason;
      EXPECT_NEAR(solved->find("centre_mm")->values[0], chuck.centre.x(), 1e-8);
      EXPECT_NEAR(solved->find("centre_mm")->values[1], chuck.centre.y(), 1e-8);
      EXPECT_NEAR(solved->find("radius_mm")->value(), chuck.radius, 1e-8);
      EXPECT_NEAR(solved->find("psi0_rad")->value(), chuck.psi, 1e-11);
      // The source's own steps come to the same.
      EXPECT_NEAR(solved->find("source_centre_mm")->values[0], chuck.centre.x(), 1e-7);
      EXPECT_NEAR(solved->find("source_centre_mm")->values[1], chuck.centre.y(), 1e-7);
    }
  }
}

TEST(LimitedAccess, SourceStepsGiveTheWorkedExample) {
  const Vector2d plus{393.19448823, 452.892081501};
  const Vector2d minus{-378.055484459, 465.00784424};
  EXPECT_NEAR(remainingShift(plus, minus), -0.015707963, 1e-9);
  ReachedChuck straight;
  straight.psi = 0.0;
  const double theta = 40.0 * kDegree;
  EXPECT_NEAR(straight.ball(theta).x(), 386.022565812, 1e-8);
  const auto rim = rimCentre(straight.ball(theta), straight.ball(-theta), {.35, 599.38});
  ASSERT_TRUE(rim.has_value());
  EXPECT_NEAR(rim->centre.x(), 0.35, 1e-9);
  EXPECT_NEAR(rim->centre.y(), -0.62, 1e-9);
  EXPECT_NEAR(rim->radius, 600.0, 1e-9);
  EXPECT_FALSE(rimCentre({300, 500}, {-300, 500}, {0, 500}).has_value());
}

TEST(LimitedAccess, SaysSoWhenTheSourceStepsDisagree) {
  std::mt19937_64 random{3};
  Dataset dataset = rimDataset({}, {-0.7, 0.7, 0.0, 0.35, -0.35, 0.2, -0.2, 0.5, -0.5}, 0.001, 0.0, random);
  EXPECT_THAT(solve(dataset)->warnings, testing::IsEmpty());
  columnNamed(dataset, "readings", "y_mm")[2] += 0.05;
  EXPECT_THAT(solveCentrelineLimitedAccess(dataset)->warnings, testing::Contains(HasSubstr("three readings")));
  EXPECT_EQ(solve(dataset)->dropped.at(0).name, "readings 3") << "which is left out of the answer";
}

TEST(LimitedAccess, RefusesByName) {
  std::mt19937_64 random{4};
  const auto refusal = [&](const std::vector<double>& angles) {
    return refusalOf(rimDataset({}, angles, 0.001, 0.0, random));
  };
  EXPECT_EQ(refusal(fiveAngles(14.9 * kDegree)), "arc-too-short");
  EXPECT_EQ(refusal(fiveAngles(15.1 * kDegree)), "");
  EXPECT_EQ(refusal({0.3}), "arc-too-short");
  EXPECT_EQ(refusal({0.0, 5 * kDegree, 355 * kDegree}), "arc-too-short") << "five degrees to either side";
  EXPECT_EQ(refusal({0.0, 20 * kDegree, 340 * kDegree}), "");
}

// A control may count C from 0 to 360 degrees.
TEST(LimitedAccess, TakesAnglesWholeTurnsApart) {
  std::mt19937_64 random{6};
  const Dataset dataset = rimDataset({}, {-0.7, 0.7, 0.0, 0.35, -0.35}, 0.001, 0.0, random);
  Dataset counted = dataset;
  for (double& c : columnNamed(counted, "readings", "C_rad_clockwise_from_plus_y")) {
    if (c < 0) c += kTurn;
  }
  const auto solved = solve(dataset);
  const auto again = solve(counted);
  ASSERT_TRUE(solved.ok() && again.ok()) << again.error().reason;
  for (const char* key : {"centre_mm", "source_centre_mm"}) {
    ASSERT_TRUE(solved->find(key) && again->find(key)) << key;
    for (std::size_t k = 0; k < 2; ++k) {
      EXPECT_NEAR(again->find(key)->values[k], solved->find(key)->values[k], 1e-7) << key;
    }
  }
}

// Where the rim ball touches a stylus ball: both radii together off the ball's path, found by bisection.
double contact(const ReachedChuck& chuck, const Vector2d& stylus, double reach, double inside, double outside) {
  for (int step = 0; step < 100; ++step) {
    const double middle = (inside + outside) / 2.0;
    ((chuck.ball(middle) - stylus).norm() < reach ? inside : outside) = middle;
  }
  return inside;
}

TEST(CZeroShift, PutsTheBallOnTheNominalLine) {
  std::mt19937_64 random{5};
  for (int trial = 0; trial < 50; ++trial) {
    const ReachedChuck chuck = randomReachedChuck(random);
    const double h = uniform(random, 20, 40);
    const double reach = 15.5;
    const double y = chuck.radius + chuck.centre.y() - uniform(random, 0.0, 0.5);
    Dataset dataset{.method = "c-zero-shift", .config = {}, .tables = {}};
    // Clockwise towards the stylus at +h, and anticlockwise towards the one at -h.
    addTable(dataset, "contacts", {"C1_rad", "C2_rad"})
        .append({contact(chuck, {h, y}, reach, h / chuck.radius - chuck.psi, -0.1 - chuck.psi),
                 contact(chuck, {-h, y}, reach, -h / chuck.radius - chuck.psi, 0.1 - chuck.psi)});
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_NEAR(chuck.ball(solved->find("C_shift_rad")->value()).x(), 0.0, 1e-3) << "one um";
    EXPECT_TRUE(solved->find("C_shift_rad")->sd.empty());
  }
}

// A control that counts C from 0 to 360 degrees: contacts on either side of its zero.
TEST(CZeroShift, TakesContactsWholeTurnsApart) {
  Dataset dataset{.method = "c-zero-shift", .config = {{"sigma_C_rad", 1e-5}}, .tables = {}};
  Table& table = addTable(dataset, "contacts", {"C1_rad", "C2_rad"});
  table.append({0.010, kTurn - 0.006});
  table.append({0.010 + kTurn, -0.006});
  table.append({0.010, -0.006});
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("C_shift_rad")->value(), 0.002, 1e-12);
  EXPECT_LT(solved->rms, 1e-12);
  columnNamed(dataset, "contacts", "C2_rad")[1] = 2.5;
  EXPECT_EQ(refusalOf(dataset), "not-opposite") << "they are not at both sides of one stylus";
}

TEST(CZeroShift, KnowsItsSdFromSigmaOrFromRepetitions) {
  Dataset dataset{.method = "c-zero-shift", .config = {{"sigma_C_rad", 1e-5}}, .tables = {}};
  Table& table = addTable(dataset, "contacts", {"C1_rad", "C2_rad"});
  table.append({0.010, -0.006});
  EXPECT_NEAR(solve(dataset)->find("C_shift_rad")->sd[0], 1e-5 / std::numbers::sqrt2, 1e-12);
  dataset.config.clear();
  tableNamed(dataset, "contacts").append({0.012, -0.006});
  EXPECT_NEAR(solve(dataset)->find("C_shift_rad")->value(), 0.0025, 1e-12);
  EXPECT_TRUE(solve(dataset)->find("C_shift_rad")->sd.empty()) << "two of them tell no sd";
  for (const double c1 : {0.010, 0.012, 0.011}) tableNamed(dataset, "contacts").append({c1, -0.006});
  // Squares 1e-6 at four degrees of freedom, of five, and next to nothing of the steps of 1e-3.
  EXPECT_NEAR(solve(dataset)->find("C_shift_rad")->sd[0], std::sqrt(1e-6 / 2 / 5), 1e-8);
  tableNamed(dataset, "contacts").append({0.012, 0.012});
  EXPECT_EQ(refusalOf(dataset), "not-opposite");
}

}  // namespace
}  // namespace probebox::metrology
