// X of the turning axis of a lathe without Y, against readings of balls that are turned about a leaning axis.
#include "firmware/metrology/centreline/centreline_x.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <random>
#include <vector>

#include "host-tests/metrology/cases.hpp"

namespace probebox::metrology {
namespace {

using testing::DoubleNear;

constexpr double kHalf = std::numbers::pi;

struct TurnedBall {
  double z{}, arm_x{}, arm_y{};  // mm
};

struct Axis {
  double at_zero{}, slope{};  // mm, mm/mm
};

// Each ball at each angle; angles are stops, in which C is off by sigma_angle.
Dataset readings(const Axis& axis, const std::vector<TurnedBall>& balls, const std::vector<double>& angles,
                 double sigma, double sigma_angle, std::mt19937_64& random) {
  Dataset dataset{.method = "centreline-x", .config = {{"sigma_mm", sigma}}, .tables = {}};
  if (sigma_angle > 0) dataset.config["sigma_C_rad"] = sigma_angle;
  Table& table = addTable(dataset, "readings", {"z_mm", "C_rad", "x_mm", "stop"});
  double stop = 0;
  for (const double angle : angles) {
    const double c = angle + gauss(random, sigma_angle);
    for (const auto& ball : balls) {
      const double x = axis.at_zero + axis.slope * ball.z + ball.arm_x * std::cos(c) - ball.arm_y * std::sin(c);
      table.append({ball.z, angle, x + gauss(random, sigma), stop});
    }
    ++stop;
  }
  return dataset;
}

TEST(CentrelineX, StatesItsUncertaintyAndReachesTheBoundOfTwoAngles) {
  std::mt19937_64 random{1};
  Judgement centre, slope;
  for (int trial = 0; trial < 800; ++trial) {
    const Axis axis{uniform(random, -1, 1), uniform(random, -5e-4, 5e-4)};
    const double low = uniform(random, 20, 60), high = uniform(random, 100, 200), sigma = uniform(random, 2e-4, 3e-3);
    const std::vector<TurnedBall> balls{{low, uniform(random, -1, 1), uniform(random, -1, 1)},
                                        {high, uniform(random, -1, 1), uniform(random, -1, 1)}};
    const auto solved = solve(readings(axis, balls, {0, kHalf}, sigma, 0, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto* x = solved->find("centre_x_mm");
    const auto* k = solved->find("C_tilt_x_rad");
    centre.add(x->value() - axis.at_zero - axis.slope * (low + high) / 2, x->sd[0], sigma / 2);
    slope.add(k->value() - axis.slope, k->sd[0], sigma / (high - low));
  }
  expectHonest(centre);
  expectHonest(slope);
}

// Arms of some ten millimetres: what a stop is off by moves both balls.
TEST(CentrelineX, StatesTheNoiseOfTheAngleThatItsReadingsShare) {
  std::mt19937_64 random{2};
  Judgement centre, slope;
  for (int trial = 0; trial < 800; ++trial) {
    const Axis axis{uniform(random, -1, 1), uniform(random, -5e-4, 5e-4)};
    const std::vector<TurnedBall> balls{{50, uniform(random, -30, 30), uniform(random, -30, 30)},
                                        {150, uniform(random, -30, 30), uniform(random, -30, 30)}};
    const auto solved =
        solve(readings(axis, balls, {0, kHalf / 3, kHalf, 1.4 * kHalf, 1.7 * kHalf}, 5e-4, 5e-5, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto* x = solved->find("centre_x_mm");
    const auto* k = solved->find("C_tilt_x_rad");
    centre.add(x->value() - axis.at_zero - axis.slope * 100, x->sd[0], x->sd[0]);
    slope.add(k->value() - axis.slope, k->sd[0], k->sd[0]);
  }
  expectHonest(centre);
  expectHonest(slope);
}

// docs/metrology.md, B.6a.
TEST(CentrelineX, GivesTheWorkedNumber) {
  Dataset dataset{.method = "centreline-x", .config = {{"sigma_mm", 0.001}}, .tables = {}};
  Table& table = addTable(dataset, "readings", {"z_mm", "C_rad", "x_mm"});
  table.append({80, 0, 0.55});
  table.append({80, kHalf, -0.25});
  table.append({160, 0, -0.02});
  table.append({160, kHalf, 0.38});
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_THAT(solved->find("centre_x_mm")->value(), DoubleNear(0.165, 1e-12));
  EXPECT_THAT(solved->find("mean_z_mm")->value(), DoubleNear(120, 1e-12));
  EXPECT_THAT(solved->find("C_tilt_x_rad")->value(), DoubleNear(0.000375, 1e-12));
  EXPECT_THAT(solved->find("centre_x_on_diameter_mm")->value(), DoubleNear(0.33, 1e-12));
  EXPECT_THAT(solved->find("centre_x_mm")->sd[0], DoubleNear(0.0005, 1e-9));
  EXPECT_THAT(solved->find("C_tilt_x_rad")->sd[0], DoubleNear(12.5e-6, 1e-10));
}

// Where C counts the other way round, the arm across X is on the other side, of which X tells nothing: the axis stays.
TEST(CentrelineX, FindsTheAxisWhicheverWayCCounts) {
  std::mt19937_64 random{3};
  const std::vector<double> angles{0, 0.5, 2, 4};
  auto dataset = readings({0.2, 0}, {{100, 3, 5}}, angles, 1e-6, 0, random);
  for (double& c : columnNamed(dataset, "readings", "C_rad")) c = -c;
  const auto wrong = solve(dataset);
  dataset.config["C_sense"] = -1.0;
  const auto right = solve(dataset);
  ASSERT_TRUE(right.ok());
  EXPECT_NEAR(right->find("centre_x_mm")->value(), 0.2, 1e-5);
  ASSERT_TRUE(wrong.ok());
  EXPECT_NEAR(wrong->find("centre_x_mm")->value(), 0.2, 1e-5);
  EXPECT_NEAR(right->find("arms_mm")->values[1], 5, 1e-4);
  EXPECT_NEAR(wrong->find("arms_mm")->values[1], -5, 1e-4);
}

TEST(CentrelineX, KeepsClampingsOfOneHeightApart) {
  std::mt19937_64 random{4};
  auto dataset =
      readings({0.2, 1e-4}, {{100, 0.3, 0.1}, {100.2, -0.4, 0.5}, {150, 0.2, 0}}, {0, kHalf, 1, 4}, 1e-6, 0, random);
  const auto merged = solve(dataset);
  Table& table = tableNamed(dataset, "readings");
  std::vector<double> balls;
  for (std::size_t row = 0; row < table.rows(); ++row) balls.push_back(static_cast<double>(row % 3 + 1));
  table.columns.push_back({"ball", balls});
  const auto apart = solve(dataset);
  ASSERT_TRUE(apart.ok()) << apart.error().reason;
  EXPECT_NEAR(apart->find("C_tilt_x_rad")->value(), 1e-4, 1e-7);
  EXPECT_TRUE(!merged || !merged->warnings.empty()) << "two arms are no one ball's";
}

std::string refusalOf(const std::vector<TurnedBall>& balls, const std::vector<double>& angles) {
  std::mt19937_64 random{5};
  const auto solved = solve(readings({0.2, 1e-4}, balls, angles, 1e-3, 0, random));
  return solved.ok() ? "" : solved.error().name;
}

TEST(CentrelineX, RefusesWhatDoesNotTellTheAxis) {
  EXPECT_EQ(refusalOf({{100, 0.3, 0.1}}, {0}), "too-few-readings");
  EXPECT_EQ(refusalOf({{100, 0.3, 0.1}, {150, 0.2, 0}}, {0}), "angles-too-close");
  EXPECT_EQ(refusalOf({{100, 0.3, 0.1}}, {0, 0.02}), "angles-too-close");
  EXPECT_EQ(refusalOf({{100, 0.3, 0.1}, {105, 0.2, 0}}, {0, kHalf}), "span-too-small");
  EXPECT_EQ(refusalOf({{100, 0.3, 0.1}, {150, 0.2, 0}}, {0, kHalf}), "");
  EXPECT_EQ(refusalOf({{100, 0.3, 0.1}}, {0, kHalf}), "") << "one height has a place without a slope";
}

}  // namespace
}  // namespace probebox::metrology
