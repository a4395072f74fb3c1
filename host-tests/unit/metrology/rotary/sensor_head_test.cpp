// The sensor head that reads a ball plate.
#include "firmware/metrology/rotary/sensor_head.hpp"

#include <Eigen/LU>
#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/sensor_heads.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

TEST(SensorHead, ReachesTheBoundAndStatesItsUncertainty) {
  std::mt19937_64 random{6};
  Judgement matrix;
  Moments balls;
  for (int trial = 0; trial < 200; ++trial) {
    const Sensors sensors = randomSensors(random);
    const double sigma = uniform(random, 1e-4, 1e-3);
    const std::vector<Vector3d> truth{anywhere(random, 100), anywhere(random, 100)};
    const auto solved = solve(headDataset(sensors, 0.3, sigma, random, truth));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto& found = *solved->find("sensor_matrix");
    // Six symmetric places an axis: sum u^2 = 2 (1 + .36 + .04) reach^2.
    const double bound = sigma / std::sqrt(2.8 * 0.09);
    for (std::size_t k = 0; k < 9; ++k) {
      const double real = sensors.matrix(static_cast<Eigen::Index>(k / 3), static_cast<Eigen::Index>(k % 3));
      matrix.add(found.values[k] - real, found.sd[k], bound);
    }
    const auto& at = *solved->find("ball_mm");
    for (std::size_t k = 0; k < 6; ++k) {
      balls.add(at.values[k] - truth[k / 3][static_cast<Eigen::Index>(k % 3)], at.sd[k]);
    }
  }
  expectHonest(matrix);
  expectHonest(balls);
}

// Six moves leave six degrees of freedom: so few residuals tell the noise of a reading poorly (Student's factor).
TEST(SensorHead, IsAsUncertainAsItSaysByTheResidualsOfFewMoves) {
  std::mt19937_64 random{14};
  Moments balls;
  for (int trial = 0; trial < 2000; ++trial) {
    const Sensors sensors = randomSensors(random);
    const Vector3d truth = anywhere(random, 100);
    Dataset dataset = headDataset(sensors, 0.3, 5e-4, random, {truth});
    dataset.config.erase("sigma_sensor");
    auto& moves = tableNamed(dataset, "moves");
    for (auto& column : moves.columns) {
      const auto all = column.values;
      column.values = {all[0], all[5], all[6], all[11], all[12], all[17]};  // the ends of each axis
    }
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto& at = *solved->find("ball_mm");
    for (std::size_t k = 0; k < 3; ++k) balls.add(at.values[k] - truth[static_cast<Eigen::Index>(k)], at.sd[k]);
  }
  EXPECT_THAT(balls.pull(), testing::AllOf(testing::Gt(0.9), testing::Lt(1.12)));
}

TEST(SensorHead, SaysThatAReadingIsInTheUnitOfTheSensors) {
  std::mt19937_64 random{11};
  const auto solved = solve(headDataset(randomSensors(random), 0.3, 1e-4, random, {}));
  EXPECT_EQ(solved->design_per, "one sensor, units of the sensors");
  EXPECT_EQ(solved->residuals.unit, "units of the sensors");
}

TEST(SensorHead, FindsTheBallWithoutNoise) {
  std::mt19937_64 random{7};
  const Sensors sensors = randomSensors(random);
  Dataset dataset = headDataset(sensors, 0.3, 0.0, random, {{10, 20, 30}});
  dataset.config["tool_vector_mm"] = std::vector<double>{1, 2, 3};
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  EXPECT_THAT(solved->find("ball_mm")->values,
              testing::ElementsAre(testing::DoubleNear(11, 1e-9), testing::DoubleNear(22, 1e-9),
                                   testing::DoubleNear(33, 1e-9)));
}

TEST(SensorHead, TellsWhereTheMachineStandsWhenAllSensorsReadZero) {
  std::mt19937_64 random{13};
  Moments moments;
  for (int trial = 0; trial < 150; ++trial) {
    const Sensors sensors = randomSensors(random);
    Dataset dataset = headDataset(sensors, 0.3, uniform(random, 1e-4, 1e-3), random, {});
    dataset.config["reference_mm"] = std::vector<double>{100, 200, -50};
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    EXPECT_THAT(solved->warnings, testing::Each(testing::Not(testing::HasSubstr("reference_mm"))));
    // The machine moves by m, and the ball goes to -m: zero + matrix * -m has to be nothing.
    const Vector3d truth = Vector3d{100, 200, -50} + sensors.matrix.inverse() * sensors.zero;
    const auto& centred = *solved->find("centred_mm");
    for (std::size_t k = 0; k < 3; ++k)
      moments.add(centred.values[k] - truth[static_cast<Eigen::Index>(k)], centred.sd[k]);
  }
  expectHonest(moments);
}

TEST(SensorHead, SaysThatABallIsFurtherThanTheMoves) {
  std::mt19937_64 random{15};
  const Sensors sensors = randomSensors(random);
  const Dataset dataset = headDataset(sensors, 0.3, 1e-4, random, {{10, 20, 30}, {-10, 20, 30}});
  const auto readFrom = [&](double away_mm) {
    Dataset d = dataset;
    const Vector3d s = sensors.zero + sensors.matrix * Vector3d{0, away_mm, 0};
    for (const std::size_t k : {0U, 1U, 2U}) {
      auto& values = columnNamed(d, "readings", std::array{"s1", "s2", "s3"}[k]);
      values = {sensors.zero[static_cast<Eigen::Index>(k)], s[static_cast<Eigen::Index>(k)]};
    }
    return d;
  };
  EXPECT_THAT(solve(readFrom(0.44))->warnings, testing::Not(testing::Contains(testing::HasSubstr("row 2"))));
  EXPECT_THAT(solve(readFrom(0.46))->warnings,
              testing::Contains(testing::AllOf(testing::HasSubstr("row 2"), testing::HasSubstr("sensors"))));
  EXPECT_THAT(solve(readFrom(19))->warnings, testing::Contains(testing::HasSubstr("move further")));
  EXPECT_EQ(refusalOf(readFrom(21)), "implausible");
}

TEST(SensorHead, RefusesByName) {
  std::mt19937_64 random{8};
  const Sensors good = randomSensors(random);
  const auto refusal = [&](const Sensors& sensors, double reach, const std::function<void(Dataset&)>& damage) {
    Dataset dataset = headDataset(sensors, reach, 0.001, random, {});
    damage(dataset);
    return refusalOf(dataset);
  };
  const auto keep = [](Dataset&) {};
  EXPECT_EQ(refusal(good, 0.3, keep), "");
  EXPECT_EQ(refusal(good, 1e-4, keep), "moves-too-small");
  Sensors one_side = good;
  one_side.matrix.row(1) = one_side.matrix.row(0) + 0.01 * one_side.matrix.row(1);
  EXPECT_EQ(refusal(one_side, 0.3, keep), "sensors-dependent");
  const auto twoAxes = [](Dataset& d) { keepRows(tableNamed(d, "moves"), [](std::size_t row) { return row < 12; }); };
  EXPECT_EQ(refusal(good, 0.3, twoAxes), "dependent-directions");
  const auto few = [](Dataset& d) { keepRows(tableNamed(d, "moves"), [](std::size_t row) { return row < 3; }); };
  EXPECT_EQ(refusal(good, 0.3, few), "too-few-readings");
  EXPECT_EQ(refusal(good, 0.3, [](Dataset& d) { columnNamed(d, "moves", "s2")[0] = std::nan(""); }), "not-finite");
}

}  // namespace
}  // namespace probebox::metrology
