// Offset and direction of the C and the spindle axis, against a machine in three dimensions whose axes are
// where they are: the reading is the position at which the stylus ball meets the ball on the chuck.
#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <rapidcheck/gtest.h>

#include "firmware/metrology/centreline/standing_axes.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/fisher.hpp"
#include "host-tests/metrology/mill_turn.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

// --- Offset of the axes (B.4, B.5) ---

std::vector<Row> together(double step) {
  std::vector<Row> rows;
  for (int k = 0; k < 4; ++k) rows.push_back({0.0, step * k, step * k, {}});
  return rows;
}

// The unknowns of an untilted machine: C axis, ball, stylus.
Machine machineOf(const VectorXd& p) {
  Machine machine;
  machine.c_point = {p[0], p[1], 0.0};
  machine.ball = {p[2], p[3], 80.0};
  machine.stylus = p.segment<2>(4);
  return machine;
}

TEST(SpindleOffset2x2, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{7};
  Judgement offset;
  Judgement stylus;
  for (int trial = 0; trial < 800; ++trial) {
    Machine machine = randomMachine(random, 0.0);
    const double sigma = uniform(random, 2e-4, 5e-3);
    auto rows = grid({0.0}, kOpposed, kOpposed);
    if (trial % 3 == 0) rows.pop_back();
    if (trial % 3 == 1) rows = grid({0.0}, {0.0, 2.0, 4.5}, {0.2, 1.4, 4.0});
    const auto ideal = read(rows, machine);
    auto noisy = ideal;
    blur(noisy, sigma, random);
    const auto solved = solve(ballDataset("spindle-offset-2x2", "", noisy, sigma));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const VectorXd truth =
        (VectorXd{6} << machine.c_point.head<2>(), machine.ball.head<2>(), machine.stylus).finished();
    const auto covariance =
        smallestCovariance([&](const VectorXd& p) { return stacked(read(rows, machineOf(p))); }, truth, sigma);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      offset.add(solved->find("offset_C_minus_A_mm")->values[k] - machine.c_point[at],
                 solved->find("offset_C_minus_A_mm")->sd[k], std::sqrt(covariance(at, at)));
      stylus.add(solved->find("stylus_offset_mm")->values[k] - machine.stylus[at],
                 solved->find("stylus_offset_mm")->sd[k], std::sqrt(covariance(at + 4, at + 4)));
    }
  }
  expectHonest(offset);
  expectHonest(stylus);
}

TEST(SpindleOffset2x2, GivesTheWorkedExampleAndItsSigma) {
  auto rows = grid({0.0}, kOpposed, kOpposed);
  const std::array<Vector2d, 4> at{Vector2d{15.086, 5.046}, Vector2d{15.126, 5.02}, Vector2d{-14.914, -5.354},
                                   Vector2d{-14.874, -5.38}};
  for (std::size_t k = 0; k < 4; ++k) rows[k].at = at[k];
  const auto solved = solve(ballDataset("spindle-offset-2x2", "", rows, 0.001));
  const auto expect = [&](const char* key, double x, double y) {
    EXPECT_NEAR(solved->find(key)->values[0], x, 1e-9) << key;
    EXPECT_NEAR(solved->find(key)->values[1], y, 1e-9) << key;
  };
  expect("offset_C_minus_A_mm", 0.106, -0.167);
  expect("ball_offset_mm", 15.0, 5.2);
  expect("stylus_offset_mm", 0.02, -0.013);
  expect("tip_to_C_mm", 0.086, -0.154);  // (B12): mean over C at spindle 0
  EXPECT_NEAR(solved->find("offset_C_minus_A_mm")->sd[0], 0.0005, 1e-12);
  EXPECT_NEAR(solved->find("stylus_offset_mm")->sd[1], 0.0005, 1e-12);
}

TEST(SpindleOffsetFour, GivesTheWorkedExampleAndItsSigma) {
  auto rows = together(kPi / 2.0);
  const std::array<Vector2d, 4> at{Vector2d{15.086, 5.046}, Vector2d{-5.107, 14.813}, Vector2d{-14.874, -5.38},
                                   Vector2d{5.319, -15.147}};
  for (std::size_t k = 0; k < 4; ++k) rows[k].at = at[k];
  const auto solved = solve(ballDataset("spindle-offset-four", "", rows, 0.001));
  EXPECT_NEAR(solved->find("offset_C_minus_A_mm")->values[0], 0.106, 1e-9);
  EXPECT_NEAR(solved->find("offset_C_minus_A_mm")->values[1], -0.167, 1e-9);
  EXPECT_NEAR(solved->find("offset_C_minus_A_mm")->sd[0], 0.0005, 1e-12);
}

TEST(SpindleOffsetFour, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{8};
  Judgement judgement;
  for (int trial = 0; trial < 800; ++trial) {
    const Machine machine = randomMachine(random, 0.0);
    const double sigma = uniform(random, 2e-4, 5e-3);
    auto noisy = read(together(trial % 2 == 0 ? kPi / 2.0 : 1.2), machine);
    blur(noisy, sigma, random);
    const auto solved = solve(ballDataset("spindle-offset-four", "", noisy, sigma));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    // Only ball minus stylus is seen.
    const VectorXd truth = (VectorXd{4} << machine.c_point.head<2>(), machine.ball.head<2>()).finished();
    const auto covariance = smallestCovariance(
        [&](const VectorXd& p) {
          return stacked(read(noisy, machineOf((VectorXd{6} << p, machine.stylus).finished())));
        },
        truth, sigma);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      judgement.add(solved->find("offset_C_minus_A_mm")->values[k] - machine.c_point[at],
                    solved->find("offset_C_minus_A_mm")->sd[k], std::sqrt(covariance(at, at)));
    }
  }
  expectHonest(judgement);
}

RC_GTEST_PROP(SpindleOffset, IsExactWithoutNoiseForAnySenses, ()) {
  std::mt19937_64 random{*rc::gen::arbitrary<std::uint64_t>()};
  const Machine machine = randomMachine(random, 0.0);
  auto rows = read(*rc::gen::element(together(kPi / 2.0), grid({0.0}, kOpposed, {0.0, 1.0, 2.0})), machine);
  const double a_sense = *rc::gen::element(1.0, -1.0);
  const double c_sense = *rc::gen::element(1.0, -1.0);
  for (auto& row : rows) {
    row.spindle *= a_sense;
    row.c *= c_sense;
  }
  std::ranges::shuffle(rows, random);
  Dataset dataset = ballDataset("spindle-offset-four", "", rows, 0.001);
  dataset.config["A_sense"] = a_sense;
  dataset.config["C_sense"] = c_sense;
  const auto solved = solve(dataset);
  RC_ASSERT(solved.ok());
  RC_ASSERT(std::abs(solved->find("offset_C_minus_A_mm")->values[0] - machine.c_point.x()) < 1e-9);
  RC_ASSERT(std::abs(solved->find("offset_C_minus_A_mm")->values[1] - machine.c_point.y()) < 1e-9);
}

TEST(SpindleOffset, RefusesByName) {
  const Machine machine;
  const auto refusal = [&](const char* method, const std::vector<Row>& rows) {
    return refusalOf(ballDataset(method, "", read(rows, machine), 0.001));
  };
  for (const char* method : {"spindle-offset-four", "spindle-offset-2x2"}) {
    EXPECT_EQ(refusal(method, grid({0.0}, {0.0}, {0.0})), "angles-too-close");
    EXPECT_EQ(refusal(method, grid({0.0}, {0.0}, kOpposed)), "spindle-not-turned");
    EXPECT_EQ(refusal(method, grid({0.0}, kOpposed, {1.0})), "c-not-turned");
    EXPECT_EQ(refusal(method, grid({0.0}, {0.0, 0.01}, {0.0, 0.02})), "angles-too-close");
    EXPECT_EQ(refusal(method, {{0, 0, 0, {}}, {0, kPi, 0.0, {}}}), "c-not-turned");
  }
  EXPECT_EQ(refusal("spindle-offset-2x2", together(kPi / 2.0)), "dependent-angles");
  EXPECT_EQ(refusal("spindle-offset-2x2", {{0, 0, 0, {}}, {0, 1.0, 2.0, {}}}), "too-few-readings");
  Dataset wrong = ballDataset("spindle-offset-2x2", "", read(grid({0.0}, kOpposed, kOpposed), machine), 0.001);
  wrong.config["A_sense"] = 0.5;
  EXPECT_EQ(refusalOf(wrong), "bad-config");
}

// Angles as a control measures them: those of one pose are not quite equal, and say nothing about spindle and C apart.
std::vector<Row> measuredBeside(std::vector<Row> rows, const Machine& machine, double most_rad,
                                std::mt19937_64& random) {
  for (auto& row : rows) {
    row.spindle += uniform(random, -most_rad, most_rad);
    row.c += uniform(random, -most_rad, most_rad);
  }
  return read(rows, machine);
}

TEST(SpindleOffsetFour, TakesAxesThatTurnTogetherToWhatAControlCanTell) {
  std::mt19937_64 random{18};
  for (const double most_rad : {2e-6, 1e-4, kPoseTolerance_rad}) {
    Judgement judgement;
    for (int trial = 0; trial < 400; ++trial) {
      Machine machine = randomMachine(random, 0.0);
      machine.stylus = 1e-2 * machine.stylus;  // what the angles are apart moves its offset
      auto noisy = measuredBeside(together(kPi / 2.0), machine, most_rad, random);
      blur(noisy, 0.001, random);
      const auto solved = solve(ballDataset("spindle-offset-four", "", noisy, 0.001));
      ASSERT_TRUE(solved.ok()) << most_rad << ": " << solved.error().reason;
      for (std::size_t k = 0; k < 2; ++k) {
        judgement.add(solved->find("offset_C_minus_A_mm")->values[k] - machine.c_point[static_cast<Eigen::Index>(k)],
                      solved->find("offset_C_minus_A_mm")->sd[k], 0.0005);
      }
    }
    SCOPED_TRACE(most_rad);
    expectHonest(judgement);
  }
}

TEST(SpindleOffset2x2, IsNotDeceivedByTheDigitsOfAControl) {
  std::mt19937_64 random{19};
  for (const double most_rad : {2e-6, 1e-4, kPoseTolerance_rad}) {
    const auto refusal = [&](const std::vector<Row>& rows) {
      return refusalOf(ballDataset("spindle-offset-2x2", "", measuredBeside(rows, {}, most_rad, random), 0.001));
    };
    EXPECT_EQ(refusal(together(kPi / 2.0)), "dependent-angles") << most_rad;
    EXPECT_EQ(refusal(grid({0.0}, {0.0}, kOpposed)), "spindle-not-turned") << most_rad;
    EXPECT_EQ(refusal(grid({0.0}, kOpposed, {1.0})), "c-not-turned") << most_rad;
    EXPECT_EQ(refusal(grid({0.0}, kOpposed, kOpposed)), "") << most_rad;
  }
}

TEST(SpindleOffsetFour, SaysWhatIsUndeterminedAlsoWhereAnglesAreMeasured) {
  std::mt19937_64 random{20};
  const auto dataset = ballDataset("spindle-offset-four", "",
                                   measuredBeside(together(kPi / 2.0), {}, kPoseTolerance_rad, random), 0.001);
  ASSERT_TRUE(undeterminedByAngles(dataset));
  EXPECT_NE(undeterminedByAngles(dataset)->find("turned together"), std::string::npos);
}

// --- Direction of the axes (B.6, B.7) ---

TEST(CAxisAlignment, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{9};
  Judgement judgement;
  for (int trial = 0; trial < 500; ++trial) {
    Machine machine = randomMachine(random, 4e-4);
    machine.spindle_tilt.setZero();
    const double sigma = uniform(random, 2e-4, 3e-3);
    std::vector<double> heights{80.0, 80.0 + uniform(random, 20, 150)};
    for (int k = 0; k < trial % 4; ++k) heights.push_back(uniform(random, 90, 250));
    auto rows = readAtHeights(grid(heights, kOpposed, kOpposed), machine);
    if (trial % 5 == 0) rows.erase(rows.begin() + 2);
    blur(rows, sigma, random);
    const auto solved = solve(ballDataset("c-axis-alignment", "z_mm", rows, sigma));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    // Linear in: axis at height 0, its slope, a ball for each height, one stylus.
    const auto n = static_cast<Eigen::Index>(heights.size());
    const auto covariance = smallestCovariance(
        [&](const VectorXd& p) {
          VectorXd values{static_cast<Eigen::Index>(2 * rows.size())};
          for (std::size_t k = 0; k < rows.size(); ++k) {
            const auto h = std::ranges::find(heights, rows[k].lever) - heights.begin();
            values.segment<2>(static_cast<Eigen::Index>(2 * k)) =
                p.head<2>() + p.segment<2>(2) * rows[k].lever / 100.0 +
                Eigen::Rotation2Dd{rows[k].c} * p.segment<2>(6 + 2 * h) -
                Eigen::Rotation2Dd{rows[k].spindle} * p.segment<2>(4);
          }
          return values;
        },
        VectorXd::Ones(6 + 2 * n), sigma);
    for (std::size_t k = 0; k < 2; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      judgement.add(solved->find("C_tilt_rad")->values[k] - machine.c_tilt[at], solved->find("C_tilt_rad")->sd[k],
                    std::sqrt(covariance(at + 2, at + 2)) / 100.0);
    }
  }
  expectHonest(judgement);
}

TEST(CAxisAlignment, GivesTheWorkedExample) {
  std::vector<Row> rows = grid({80, 155, 230}, kOpposed, kOpposed);
  const std::array<Vector2d, 3> centres{Vector2d{.139, -.099}, Vector2d{.154, -.1105}, Vector2d{.169, -.1215}};
  for (std::size_t k = 0; k < rows.size(); ++k) {
    rows[k].at = centres[k / 4] + Eigen::Rotation2Dd{rows[k].c} * Vector2d{15, 5} -
                 Eigen::Rotation2Dd{rows[k].spindle} * Vector2d{.02, .01};
  }
  const auto solved = solve(ballDataset("c-axis-alignment", "z_mm", rows, 0.001));
  EXPECT_NEAR(solved->find("C_tilt_rad")->values[0], .0002, 1e-12);
  EXPECT_NEAR(solved->find("C_tilt_rad")->values[1], -.00015, 1e-12);
  EXPECT_NEAR(solved->find("centre_mm")->values[0], .154, 1e-9);
  EXPECT_NEAR(solved->find("centre_mm")->values[1], -.110333333, 1e-9);
  EXPECT_NEAR(solved->find("mean_z_mm")->value(), 155.0, 1e-9);
  EXPECT_NEAR(solved->find("C_tilt_rad")->sd[0], 0.0005 / std::sqrt(2 * 75.0 * 75.0), 1e-12);
}

// Every row has the height at which the ball was found.
TEST(CAxisAlignment, TakesHeightsAsTheyAreRead) {
  std::mt19937_64 random{34};
  Moments errors;
  for (int trial = 0; trial < 400; ++trial) {
    Machine machine = randomMachine(random, 4e-4);
    machine.spindle_tilt.setZero();
    auto rows = readAtHeights(grid({80, 150, 230}, kOpposed, kOpposed), machine);
    blur(rows, 0.001, random);
    for (auto& row : rows) row.lever += gauss(random, 0.002);
    const auto solved = solve(ballDataset("c-axis-alignment", "z_mm", rows, 0.001));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto& tilt = *solved->find("C_tilt_rad");
    for (std::size_t k = 0; k < 2; ++k)
      errors.add(tilt.values[k] - machine.c_tilt[static_cast<Eigen::Index>(k)], tilt.sd[k]);
  }
  expectHonest(errors);
}

TEST(CAxisAlignment, DoesNotNeedTheSpindleToTurn) {
  std::mt19937_64 random{10};
  Machine machine = randomMachine(random, 3e-4);
  const auto rows = readAtHeights(grid({80, 200}, {0.7}, kOpposed), machine);
  const auto solved = solve(ballDataset("c-axis-alignment", "z_mm", rows, 0.001));
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_NEAR(solved->find("C_tilt_rad")->values[0], machine.c_tilt.x(), 1e-8);
  EXPECT_THAT(solved->warnings, testing::Contains(testing::HasSubstr("stood still")));
}

TEST(AAxisAlignment, FindsTheSpindleWhateverTheTiltOfC) {
  std::mt19937_64 random{11};
  Judgement judgement;
  for (int trial = 0; trial < 500; ++trial) {
    const Machine machine = randomMachine(random, 3e-4);
    const double sigma = uniform(random, 2e-4, 3e-3);
    const double longer = 100.0 + uniform(random, 15, 120);
    auto rows = readWithTips(grid({100.0, longer}, kOpposed, kOpposed), machine);
    blur(rows, sigma, random);
    const auto solved = solve(ballDataset("a-axis-alignment", "tip_length_mm", rows, sigma));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    for (std::size_t k = 0; k < 2; ++k) {
      const auto at = static_cast<Eigen::Index>(k);
      judgement.add(solved->find("A_tilt_rad")->values[k] - machine.spindle_tilt[at], solved->find("A_tilt_rad")->sd[k],
                    0.5 * sigma * std::numbers::sqrt2 / (longer - 100.0));
    }
  }
  expectHonest(judgement);
}

TEST(AAxisAlignment, FollowsTheDirectionOfTheTool) {
  std::mt19937_64 random{12};
  const Machine machine = randomMachine(random, 3e-4);
  auto rows = readWithTips(grid({-100.0, -160.0, -180.0}, kOpposed, kOpposed), machine);
  for (auto& row : rows) row.lever = -row.lever;
  Dataset dataset = ballDataset("a-axis-alignment", "tip_length_mm", rows, 0.001);
  dataset.config["tool_direction"] = -1.0;
  EXPECT_NEAR(solve(dataset)->find("A_tilt_rad")->values[0], machine.spindle_tilt.x(), 1e-8);
  EXPECT_NEAR(solve(dataset)->find("A_tilt_rad")->values[1], machine.spindle_tilt.y(), 1e-8);
}

TEST(AxisAlignment, RefusesByName) {
  const Machine machine;
  const auto c_axis = [&](const std::vector<Row>& rows) {
    return refusalOf(ballDataset("c-axis-alignment", "z_mm", readAtHeights(rows, machine), 0.001));
  };
  EXPECT_EQ(c_axis(grid({80, 89.9}, kOpposed, kOpposed)), "span-too-small");
  EXPECT_EQ(c_axis(grid({80}, kOpposed, kOpposed)), "span-too-small");
  EXPECT_EQ(c_axis(grid({80, 150}, kOpposed, {0.0})), "c-not-turned");
  EXPECT_EQ(c_axis(grid({80, 150}, kOpposed, {0.0, 0.05})), "angles-too-close");
  EXPECT_EQ(c_axis(grid({80, 150}, {0.0}, {0.0})), "angles-too-close");
  const auto a_axis = [&](const std::vector<Row>& rows) {
    return refusalOf(ballDataset("a-axis-alignment", "tip_length_mm", readWithTips(rows, machine), 0.001));
  };
  EXPECT_EQ(a_axis(grid({100, 109}, kOpposed, kOpposed)), "span-too-small");
  EXPECT_EQ(a_axis(grid({100, 150}, {0.3}, kOpposed)), "spindle-not-turned");
  EXPECT_EQ(a_axis(grid({100, 150}, kOpposed, {0.3})), "") << "the ball stands still for all tips";
}

}  // namespace
}  // namespace probebox::metrology
