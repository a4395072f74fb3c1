// Ceres as an independent judge of the iterative methods: the same data, its own derivatives and minimiser, the same
// answer to nine digits.
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

#include "ceres_problems.hpp"
#include "firmware/metrology/features/sphere_fit.hpp"
#include "firmware/metrology/fit/sphere.hpp"
#include "firmware/metrology/kinematics/joint_chain.hpp"
#include "firmware/metrology/solve.hpp"
#include "firmware/metrology/touch/touch_selection.hpp"
#include "judge_cases.hpp"

namespace probebox::judge {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;
using Eigen::VectorXd;

// Nine digits of what the number is measured in, or of the number where that is larger. measured: how large what it
// comes from is, where its digits are lost.
void expectSame(const VectorXd& ours, const VectorXd& judged, double measured = 1.0) {
  ASSERT_EQ(ours.size(), judged.size());
  for (Eigen::Index k = 0; k < ours.size(); ++k) {
    EXPECT_NEAR(ours[k], judged[k], 1e-9 * std::max(measured, std::abs(judged[k]))) << "parameter " << k;
  }
}

TEST(Judge, SphereFit) {
  std::mt19937_64 random{1};
  for (int trial = 0; trial < 50; ++trial) {
    const auto points = spherePoints(random, 5 + trial % 20);
    const auto fit = metrology::fitSphere(points, {});
    ASSERT_TRUE(fit.ok()) << fit.error().reason;
    Eigen::MatrixXd covariance;
    expectSame(fit->parameters, sphere(points, &covariance));
    EXPECT_TRUE(fit->cofactor.isApprox(covariance, 1e-9));
  }
}

TEST(Judge, CentrelineWithNoiseOfTheAngle) {
  std::mt19937_64 random{2};
  for (int trial = 0; trial < 50; ++trial) {
    const metrology::RotationNoise noise{uniform(random, 3e-4, 3e-3), uniform(random, 5e-6, 2e-4)};
    const auto readings = turnedReadings(random, 5 + trial % 10, 20.0, 6.2, noise);
    const auto fit = metrology::fitRotation(readings, noise);
    ASSERT_TRUE(fit.ok()) << fit.error().reason;
    Eigen::MatrixXd covariance;
    expectSame(fit->parameters, rotation(readings, noise, &covariance));
    EXPECT_TRUE(fit->cofactor.isApprox(covariance, 1e-3)) << "ours leaves the residuals' own curvature out";
  }
}

TEST(Judge, CentrelineOfLimitedAccess) {
  std::mt19937_64 random{3};
  for (int trial = 0; trial < 50; ++trial) {
    const metrology::RotationNoise noise{uniform(random, 3e-4, 3e-3), uniform(random, 1e-6, 2e-5)};
    const auto readings = turnedReadings(random, 5, uniform(random, 300, 1200), 1.4, noise);
    metrology::Dataset dataset{.method = "centreline-limited-access",
                               .config = {{"sigma_mm", noise.position}, {"sigma_C_rad", noise.angle}},
                               .tables = {}};
    auto table = metrology::Table::withColumns(
        "readings", std::array<std::string_view, 3>{"C_rad_clockwise_from_plus_y", "x_mm", "y_mm"});
    for (const auto& reading : readings) table.append({-reading.angle, reading.at.x(), reading.at.y()});
    dataset.tables.push_back(std::move(table));
    const auto solved = metrology::solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto judged = rotation(readings, noise);
    const auto& centre = solved->find("centre_mm")->values;
    // A short arc far from the centre loses two digits, in either program.
    const double radius_mm = judged.tail<2>().norm();
    expectSame(Vector3d{centre[0], centre[1], solved->find("radius_mm")->value()},
               Vector3d{judged[0], judged[1], radius_mm}, radius_mm / 10);
    EXPECT_NEAR(solved->find("psi0_rad")->value(), std::atan2(judged[2], judged[3]), 1e-11);
  }
}

TEST(Judge, RotaryAxis) {
  std::mt19937_64 random{4};
  for (int trial = 0; trial < 50; ++trial) {
    const auto plate = plateReadings(random, 4 + trial % 5, 0.001);
    const auto solved = metrology::solve(rotaryDataset(plate));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    // The plate's place first, then the table's motion at every angle.
    const Motion place = rigid(plate.certified, plate.second);
    const Eigen::Matrix3d turned = Eigen::AngleAxisd{place.tail<3>().norm(), place.tail<3>().normalized()}.matrix();
    const auto& six = solved->find("six_errors")->values;
    for (std::size_t k = 0; k < plate.angles.size(); ++k) {
      const Eigen::Matrix3d ideal = Eigen::AngleAxisd{plate.angles[k], Vector3d::UnitZ()}.toRotationMatrix() * turned;
      const Vector3d shift = Eigen::AngleAxisd{plate.angles[k], Vector3d::UnitZ()} * place.head<3>();
      const Eigen::MatrixX3d from = (plate.certified * ideal.transpose()).rowwise() + shift.transpose();
      expectSame(Eigen::Map<const Motion>{six.data() + 6 * k}, rigid(from, plate.first[k]));
    }
  }
}

TEST(Judge, PivotInSpace) {
  std::mt19937_64 random{6};
  for (int trial = 0; trial < 30; ++trial) {
    const std::vector<double> tilts{-1.4, -0.6, 0.1, 0.5};
    const auto readings = tiltedReadings(random, tilts);
    metrology::Dataset dataset{
        .method = "table-pivot-3d", .config = {{"tilt_axis", std::vector<double>{0, 0, 1}}}, .tables = {}};
    auto table = metrology::Table::withColumns(
        "readings", std::array<std::string_view, 5>{"tilt_deg", "C_deg", "x_mm", "y_mm", "z_mm"});
    for (const auto& reading : readings) {
      table.append({reading.tilt * 180.0 / std::numbers::pi, 90.0 * static_cast<double>(reading.point), reading.at.x(),
                    reading.at.y(), reading.at.z()});
    }
    dataset.tables.push_back(std::move(table));
    const auto solved = metrology::solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    VectorXd start = VectorXd::Zero(10);
    for (const auto& reading : readings)
      start.segment<3>(4 + 3 * static_cast<Eigen::Index>(reading.point)) = reading.at;
    const VectorXd judged = pivot(readings, start);
    const auto& lean = solved->find("lean_xy_rad")->values;
    const auto& at = solved->find("pivot_xy_mm")->values;
    const double along = solved->find("along_mm")->value();
    expectSame(Vector2d{lean[0], lean[1]}, judged.segment<2>(2));
    expectSame(Vector2d{at[0], at[1]}, judged.head<2>() + along * judged.segment<2>(2));
  }
}

// What each touch says, with its weight: its radial residual over the weighted one.
std::vector<TouchedPoint> touchedPoints(const metrology::TouchModel& model,
                                        const std::vector<metrology::Retract>& retracts, const VectorXd& at) {
  const VectorXd weighted = model(at).residuals, plain = model.radial(at);
  std::vector<TouchedPoint> points;
  for (const auto& retract : retracts) {
    const auto i = static_cast<Eigen::Index>(points.size());
    points.push_back(
        {metrology::separationPoint(retract.machine, retract.probe), retract.machine.slope, plain[i] / weighted[i]});
  }
  return points;
}

TEST(Judge, TouchFit) {
  std::mt19937_64 random{5};
  for (int trial = 0; trial < 20; ++trial) {
    const auto retracts = sphereRetracts(random);
    const auto noise = metrology::poolNoise(retracts);
    metrology::TouchModel model{retracts, noise, {.gain = metrology::Gain::by_touch}};
    const auto start = model.start();
    ASSERT_TRUE(start.ok()) << start.error().reason;
    model.weighAt(start.value());
    const auto fit = metrology::leastSquares(model, start.value());
    ASSERT_TRUE(fit.ok()) << fit.error().reason;
    const auto points = touchedPoints(model, retracts, start.value());
    TouchAnswer at;
    at << model.span() * start->head(3), (*start)[3], (*start)[4];
    const TouchAnswer judged = touches(points, at);
    TouchAnswer ours;
    ours << model.span() * fit->parameters.head(3), fit->parameters[3], fit->parameters[4];
    expectSame(ours.head<4>(), judged.head<4>());
    EXPECT_NEAR(ours[4], judged[4], 1e-12) << "s; nine digits of some ms";
  }
}

TEST(Judge, TouchFitOfAnArm) {
  std::mt19937_64 random{7};
  const Arm arm;
  const metrology::JointChain chain{{{true, arm.base, Vector3d::UnitZ()},
                                     {true, arm.base + arm.upper * Vector3d::UnitX(), Vector3d::UnitZ()},
                                     {false, arm.base, Vector3d::UnitZ()}},
                                    arm.base + (arm.upper + arm.fore) * Vector3d::UnitX()};
  for (int trial = 0; trial < 20; ++trial) {
    auto retracts = sphereRetracts(random);
    addJoints(arm, retracts);
    const auto noise = metrology::poolNoise(retracts);
    metrology::TouchModel model{
        retracts,
        noise,
        {.delays = metrology::Delays::each_joint, .gain = metrology::Gain::by_touch, .kinematics = &chain}};
    const auto start = model.start();
    ASSERT_TRUE(start.ok()) << start.error().reason;
    model.weighAt(start.value());
    const auto fit = metrology::leastSquares(model, start.value());
    ASSERT_TRUE(fit.ok()) << fit.error().reason;
    std::vector<ArmTouch> points;
    for (const auto& point : touchedPoints(model, retracts, start.value())) {
      const auto& retract = retracts[points.size()];
      points.push_back({point, metrology::separationTime(retract.probe), retract.joints});
    }
    ArmAnswer at;
    at << model.span() * start->head(3), start->tail(4);
    const ArmAnswer judged = armTouches(arm, points, at);
    ArmAnswer ours;
    ours << model.span() * fit->parameters.head(3), fit->parameters.tail(4);
    expectSame(ours.head<4>(), judged.head<4>());
    for (Eigen::Index k = 4; k < 7; ++k) EXPECT_NEAR(ours[k], judged[k], 1e-12) << "s; nine digits of some ms";
  }
}

}  // namespace
}  // namespace probebox::judge
