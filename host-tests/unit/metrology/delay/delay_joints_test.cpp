// Delays of a machine whose axes are joints of a chain: an arm with two links in the plane and a quill along Z.
#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

#include "firmware/metrology/kinematics/joint_chain.hpp"
#include "firmware/metrology/kinematics/joint_path.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/touch_simulation.hpp"
#include "host-tests/metrology/two_link_arm.hpp"
#include "host-tests/support/runs.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

TEST(JointChain, PutsTheTipWhereTheArmReaches) {
  std::mt19937_64 random{1};
  const Arm arm{.base = {20.0, -30.0, 5.0}};
  const JointChain chain{arm.joints(), arm.tip()};
  EXPECT_THAT(chain.columns(), testing::ElementsAre("q1_rad", "q2_rad", "q3_mm"));
  for (int trial = 0; trial < 50; ++trial) {
    const Vector3d at =
        arm.base + Vector3d{uniform(random, 150, 300), uniform(random, -200, 200), uniform(random, -90, 90)};
    const Vector3d q = arm.inverse(at);
    EXPECT_LT((chain.tip(q) - at).norm(), 1e-9);
    const Eigen::Matrix3Xd jacobian = chain.jacobian(q);
    for (Eigen::Index k = 0; k < 3; ++k) {
      constexpr double kStep = 1e-5;
      const Vector3d by = kStep * Vector3d::Unit(k);
      EXPECT_LT((jacobian.col(k) - (chain.tip(q + by) - chain.tip(q - by)) / (2.0 * kStep)).norm(), 1e-5);
    }
  }
}

// Of a chain out of the plane: every joint turns those behind it.
TEST(JointChain, HasTheDerivativesOfAnyChain) {
  std::mt19937_64 random{2};
  const auto anywhere = [&](double size) {
    return Vector3d{uniform(random, -size, size), uniform(random, -size, size), uniform(random, -size, size)};
  };
  for (int trial = 0; trial < 50; ++trial) {
    std::vector<Joint> joints;
    for (int k = 0; k < 6; ++k) joints.push_back({k != 2, anywhere(300.0), anywhere(1.0).normalized()});
    const JointChain chain{joints, anywhere(300.0)};
    Eigen::VectorXd q{6};
    for (double& one : q) one = uniform(random, -2.0, 2.0);
    const Eigen::Matrix3Xd jacobian = chain.jacobian(q);
    for (Eigen::Index k = 0; k < 6; ++k) {
      constexpr double kStep = 1e-5;
      const Eigen::VectorXd by = kStep * Eigen::VectorXd::Unit(6, k);
      EXPECT_LT((jacobian.col(k) - (chain.tip(q + by) - chain.tip(q - by)) / (2.0 * kStep)).norm(), 1e-4);
    }
  }
}

// Joints that are late displace the tip by J diag(tau) q', but for the curvature of their ways.
TEST(JointChain, MovesTheTipByItsJacobianButForTheCurvature) {
  const Arm arm;
  const JointChain chain{arm.joints(), arm.tip()};
  JointPath path{.t_mean = 0.0, .half_s = 1.0, .coefficients = Eigen::MatrixXd::Zero(3, 3)};
  path.coefficients.col(0) = arm.inverse({330.0, 140.0, 0.0});
  path.coefficients.col(1) = Vector3d{0.05, -0.06, 0.0};  // rad/s: some 20 mm/s
  const Vector3d late{0.0042, 0.0031, 0.0};
  const Vector3d exact = shiftOf(chain, path, 0.0, late);
  const Vector3d linear = dPointPerDelay(chain, path, 0.0, Vector3d::Zero()) * late;
  EXPECT_GT(exact.norm(), 0.03);
  EXPECT_LT((exact - linear).norm(), 2e-5);
  EXPECT_GT((exact - linear).norm(), 1e-6) << "there is a curvature";
  // The derivative there is that of the exact shift.
  const Eigen::Matrix3Xd carried = dPointPerDelay(chain, path, 0.0, late);
  for (Eigen::Index k = 0; k < 3; ++k) {
    const Vector3d by = 1e-4 * Vector3d::Unit(k);
    const Vector3d numeric = (shiftOf(chain, path, 0.0, late + by) - shiftOf(chain, path, 0.0, late - by)) / 2e-4;
    EXPECT_LT((carried.col(k) - numeric).norm(), 1e-6);
  }
}

TEST(DelayJoints, FindsTheDelayOfEveryJointOfAnArm) {
  std::mt19937_64 random{3};
  for (int trial = 0; trial < 20; ++trial) {
    const Arm arm{.base = {uniform(random, -500, 500), uniform(random, -500, 500), uniform(random, -500, 500)}};
    simulation::Scene simulated = simulation::withoutNoise(scene(arm));
    simulated.bounce_mm = 0.0;
    for (double& more : simulated.more_delay_s) more = uniform(random, -0.002, 0.003);
    const auto solved = solve(measured(simulated, arm, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(solved->find("tau_joint_s")->values[k], simulated.tauOf(static_cast<Eigen::Index>(k)), 3e-8);
      EXPECT_NEAR(solved->find("centre_mm")->values[k], simulated.centre_mm[static_cast<Eigen::Index>(k)], 1e-6);
    }
    EXPECT_LT(solved->rms, 1e-6);
  }
}

TEST(DelayJoints, StatesItsUncertainty) {
  std::mt19937_64 random{4};
  std::array<Moments, 3> pulls;
  for (std::uint64_t trial = 0; trial < runs(300); ++trial) {
    const Arm arm{.base = {uniform(random, -500, 500), uniform(random, -500, 500), uniform(random, -500, 500)}};
    simulation::Scene simulated = scene(arm);
    simulated.centre_mm += Vector3d{uniform(random, -60, 60), uniform(random, -60, 60), uniform(random, -60, 60)};
    for (double& more : simulated.more_delay_s) more = uniform(random, -0.001, 0.003);
    if (trial % 2 == 0) simulated.speeds_mm_s = {10.0, 30.0};
    Dataset dataset = measured(simulated, arm, random);
    if (trial % 2 == 0) dataset.config.erase("effective_diameter_mm");
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    for (std::size_t k = 0; k < 3; ++k) {
      const auto& tau = *solved->find("tau_joint_s");
      pulls[k].add(tau.values[k] - simulated.tauOf(static_cast<Eigen::Index>(k)), tau.sd[k]);
    }
  }
  for (const auto& pull : pulls) {
    expectHonest(pull);
    EXPECT_LT(std::abs(pull.bias()), 4.0);
  }
}

// One delay for all joints is one of the tip along its way: the same touches, seen as positions, say the same.
TEST(DelayJoints, WithOneDelayIsThatOfTheTipsPositions) {
  std::mt19937_64 random{5};
  const Arm arm;
  simulation::Scene simulated = scene(arm);
  simulated.more_delay_s.setZero();
  Dataset dataset = measured(simulated, arm, random);
  dataset.config.erase("delays");
  Dataset positions = dataset;
  positions.method = "delay-known-sphere";
  positions.config.erase("tip_mm");
  std::erase_if(positions.tables, [](const Table& table) { return table.name == "chain"; });
  auto& columns = tableNamed(positions, "machine").columns;
  const JointChain chain{arm.joints(), arm.tip()};
  for (std::size_t row = 0; row < columns[0].values.size(); ++row) {
    const Vector3d tip = chain.tip(Vector3d{columns[2].values[row], columns[3].values[row], columns[4].values[row]});
    for (std::size_t k = 0; k < 3; ++k) columns[2 + k].values[row] = tip[static_cast<Eigen::Index>(k)];
  }
  for (std::size_t k = 0; k < 3; ++k) columns[2 + k].name = kMachineColumns[2 + k];
  const auto by_joints = solve(dataset);
  const auto by_positions = solve(positions);
  ASSERT_TRUE(by_joints.ok() && by_positions.ok()) << by_joints.error().reason;
  EXPECT_EQ(by_joints->find("tau_s")->values, by_positions->find("tau_s")->values);
  EXPECT_EQ(by_joints->find("tau_s")->sd, by_positions->find("tau_s")->sd);
  EXPECT_EQ(by_joints->find("centre_mm")->values, by_positions->find("centre_mm")->values);
  EXPECT_NEAR(by_joints->find("tau_s")->value(), simulated.tau(), 5.0 * by_joints->find("tau_s")->sd[0]);
}

TEST(DelayJoints, OfACartesianChainIsThatOfItsAxes) {
  std::mt19937_64 random{6};
  for (int trial = 0; trial < 20; ++trial) {
    simulation::Scene simulated = simulation::shuffled(simulation::perAxis(), random);
    if (trial % 2 == 0) simulated.more_delay_s.setZero();
    const Dataset axes = simulation::measure(simulated, random);
    Dataset joints = axes;
    joints.method = "delay-joints";
    describe(joints,
             {{false, {0, 0, 0}, Vector3d::UnitX()},
              {false, {9, 9, 9}, Vector3d::UnitY()},
              {false, {0, 0, 0}, Vector3d::UnitZ()}},
             Vector3d::Zero());
    joints.config["delays"] = std::string{"each-joint"};
    const auto by_axes = solve(axes);
    const auto by_joints = solve(joints);
    ASSERT_TRUE(by_axes.ok() && by_joints.ok()) << by_joints.error().reason;
    for (std::size_t k = 0; k < 3; ++k) {
      const double sd = by_axes->find("tau_axis_s")->sd[k];
      EXPECT_NEAR(by_joints->find("tau_joint_s")->values[k], by_axes->find("tau_axis_s")->values[k], 1e-3 * sd);
      EXPECT_NEAR(by_joints->find("tau_joint_s")->sd[k], sd, 1e-3 * sd);
      EXPECT_NEAR(by_joints->find("tau_joint_s")->design[k], by_axes->find("tau_axis_s")->design[k], 1e-3 * sd / 5e-7);
    }
    if (trial % 2 != 0) continue;
    // With one delay there is nothing off the line.
    joints.config.erase("delays");
    Dataset known = axes;
    known.method = "delay-known-sphere";
    const auto by_tip = solve(joints);
    const auto by_sphere = solve(known);
    ASSERT_TRUE(by_tip.ok() && by_sphere.ok());
    EXPECT_EQ(by_tip->find("tau_s")->values, by_sphere->find("tau_s")->values);
    EXPECT_EQ(by_tip->find("tau_s")->sd, by_sphere->find("tau_s")->sd);
  }
}

TEST(DelayJoints, DoesNotKnowWhereTheChainStands) {
  std::mt19937_64 random{7};
  const Arm arm;
  const Dataset dataset = measured(scene(arm), arm, random);
  const auto here = solve(dataset);
  ASSERT_TRUE(here.ok()) << here.error().reason;
  for (int trial = 0; trial < 5; ++trial) {
    const Matrix3d turn =
        Eigen::AngleAxisd{uniform(random, 0.1, 3.0), Vector3d{uniform(random, -1, 1), 0.5, 0.3}.normalized()}.matrix();
    const Vector3d shift{uniform(random, -500, 500), uniform(random, -500, 500), 70.0};
    Dataset moved = dataset;
    const auto apply = [&](const char* table, std::array<const char*, 3> names, const Vector3d& by) {
      for (std::size_t row = 0; row < tableNamed(moved, table).rows(); ++row) {
        Vector3d v;
        for (Eigen::Index k = 0; k < 3; ++k) v[k] = columnNamed(moved, table, names[static_cast<std::size_t>(k)])[row];
        v = turn * v + by;
        for (Eigen::Index k = 0; k < 3; ++k) columnNamed(moved, table, names[static_cast<std::size_t>(k)])[row] = v[k];
      }
    };
    apply("chain", {"px_mm", "py_mm", "pz_mm"}, shift);
    apply("chain", {"ux", "uy", "uz"}, Vector3d::Zero());
    apply("touches", {"nx", "ny", "nz"}, Vector3d::Zero());
    apply("touches", {"ux", "uy", "uz"}, Vector3d::Zero());
    const Vector3d tip = turn * arm.tip() + shift;
    moved.config["tip_mm"] = std::vector<double>{tip.x(), tip.y(), tip.z()};
    const auto there = solve(moved);
    ASSERT_TRUE(there.ok()) << there.error().reason;
    const Vector3d centre = turn * Vector3d::Map(here->find("centre_mm")->values.data()) + shift;
    for (std::size_t k = 0; k < 3; ++k) {
      EXPECT_NEAR(there->find("tau_joint_s")->values[k], here->find("tau_joint_s")->values[k], 1e-9);
      EXPECT_NEAR(there->find("tau_joint_s")->sd[k], here->find("tau_joint_s")->sd[k], 1e-9);
      EXPECT_NEAR(there->find("centre_mm")->values[k], centre[static_cast<Eigen::Index>(k)], 1e-6);
    }
  }
}

TEST(DelayJoints, MeasuresWhatIsLeftOfThePreviousDelays) {
  std::mt19937_64 random{8};
  const Arm arm;
  Dataset dataset = measured(scene(arm), arm, random);
  const auto whole = solve(dataset);
  dataset.config["previous_tau_joint_s"] = std::vector<double>{0.001, 0.002, 0.003};
  const auto residual = solve(dataset);
  ASSERT_TRUE(whole.ok() && residual.ok());
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(residual->find("tau_joint_s")->values[k],
                whole->find("tau_joint_s")->values[k] + 0.001 * static_cast<double>(k + 1), 1e-12);
    EXPECT_NEAR(residual->find("residual_tau_joint_s")->values[k], whole->find("tau_joint_s")->values[k], 1e-12);
  }
  EXPECT_THAT(residual->warnings, testing::IsEmpty());
  dataset.config["previous_tau_joint_s"] = std::vector<double>{0.001, 0.002};
  EXPECT_EQ(refusalOf(dataset), "bad-config");
}

TEST(DelayJoints, RefusesByName) {
  std::mt19937_64 random{9};
  const Arm arm;
  const auto refusal = [&](const std::function<void(Dataset&)>& damage) {
    Dataset dataset = measured(scene(arm), arm, random);
    damage(dataset);
    return refusalOf(dataset);
  };
  EXPECT_EQ(refusal([](Dataset&) {}), "");
  EXPECT_EQ(refusal([](Dataset& d) { d.tables.pop_back(); }), "missing-table");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("tip_mm"); }), "missing-key");
  EXPECT_EQ(refusal([](Dataset& d) { d.config["delays"] = std::string{"each-axis"}; }), "bad-config");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "chain", "revolute")[2] = 2.0; }), "bad-flag");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "chain", "uz")[0] = 0.5; }), "bad-direction");
  EXPECT_EQ(refusal([](Dataset& d) { tableNamed(d, "machine").columns[2].name = "q1_mm"; }), "missing-column")
      << "a revolute joint counts angles";
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "machine", "q2_rad")[7] = std::nan(""); }), "not-finite");
  EXPECT_EQ(refusal([](Dataset& d) { d.config.erase("effective_diameter_mm"); }), "single-speed");
  EXPECT_EQ(refusal([](Dataset& d) { columnNamed(d, "chain", "px_mm")[1] = 150.0; }), "wrong-direction")
      << "an arm of other lengths goes elsewhere";
}

// A joint that stands still in all touches says nothing of its delay; neither do two that always move alike.
TEST(DelayJoints, RefusesJointsWhoseDelaysTheTouchesDoNotTell) {
  std::mt19937_64 random{10};
  const Arm arm;
  simulation::Scene flat = scene(arm);
  flat.normals = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}};
  flat.speeds_mm_s = {10.0, 30.0};
  flat.more_delay_s.setZero();
  const auto standing = solve(measured(flat, arm, random));
  ASSERT_FALSE(standing.ok());
  EXPECT_EQ(standing.error().name, "joint-not-moved");
  EXPECT_THAT(standing.error().reason, testing::HasSubstr("joint 3"));
  Dataset common = measured(flat, arm, random);
  common.config.erase("delays");
  EXPECT_EQ(refusalOf(common), "");

  simulation::Scene one_way = scene(arm);
  one_way.normals.resize(3);
  one_way.speeds_mm_s = {10.0, 30.0};
  one_way.radius_mm = 3.0;  // the arm stands alike at all sides of a small sphere
  one_way.normals[2] = {0, 0, 1};
  EXPECT_EQ(refusalOf(measured(one_way, arm, random)), "one-sided");
}

}  // namespace
}  // namespace probebox::metrology
