// Machines whose platform stands on legs: deltas on slides and on cranks, and a hexapod.
#include "firmware/metrology/kinematics/parallel_kinematics.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/touch_simulation.hpp"
#include "host-tests/support/runs.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;
using testing::ElementsAre;
using testing::HasSubstr;

constexpr double kThird = 2.0 * std::numbers::pi / 3.0;

// A machine and, in closed form, the joint positions of a pose: what no iteration has to find.
struct Machine {
  std::vector<Leg> legs;
  Vector3d tip{0.0, 0.0, -120.0};  // in the reference pose
  std::function<double(const Leg& leg, const Vector3d& upper)> joint;

  ParallelKinematics kinematics() const { return {legs, tip}; }
  VectorXd at(const Vector3d& place, const Matrix3d& turned = Matrix3d::Identity()) const {
    VectorXd q{static_cast<Eigen::Index>(legs.size())};
    for (std::size_t k = 0; k < legs.size(); ++k) {
      q[static_cast<Eigen::Index>(k)] = joint(legs[k], place + turned * (legs[k].upper - tip));
    }
    return q;
  }
};

Vector3d around(double radius_mm, double angle, double z_mm) {
  return {radius_mm * std::cos(angle), radius_mm * std::sin(angle), z_mm};
}

// Carriages on three upright columns.
Machine slides() {
  Machine machine;
  for (int k = 0; k < 3; ++k) {
    const double angle = k * kThird + 0.1;
    machine.legs.push_back({LegKind::slide,
                            40.0,
                            around(400.0, angle, 420.0),
                            around(60.0, angle, 0.0),
                            {0.0, 0.0, -1.0},
                            {0.0, 0.0, 0.0}});
  }
  machine.joint = [](const Leg& leg, const Vector3d& upper) {
    const Vector3d from = upper - leg.lower;
    const double along = from.dot(leg.direction), length = (leg.upper - leg.lower).norm();
    return leg.q + along - std::sqrt(length * length - (from - along * leg.direction).squaredNorm());
  };
  return machine;
}

// Upper arms that turn about tangents of the base.
Machine cranks() {
  Machine machine;
  for (int k = 0; k < 3; ++k) {
    const double angle = k * kThird - 0.2;
    const Vector3d outwards = around(1.0, angle, 0.0), pivot = around(150.0, angle, 380.0);
    machine.legs.push_back({LegKind::crank, 0.3, pivot + 160.0 * outwards + Vector3d{0.0, 0.0, -60.0},
                            around(50.0, angle, 0.0), Vector3d::UnitZ().cross(outwards), pivot});
  }
  machine.joint = [](const Leg& leg, const Vector3d& upper) {
    // |upper - pivot - R(a) arm| = length: a cosine in a, whose branch is that of the reference pose.
    const Vector3d arm = leg.lower - leg.pivot, from = upper - leg.pivot;
    const double c = from.dot(arm), s = from.dot(leg.direction.cross(arm));
    const double wanted = 0.5 * (from.squaredNorm() + arm.squaredNorm() - (leg.upper - leg.lower).squaredNorm());
    const double middle = std::atan2(s, c), half = std::acos(wanted / std::hypot(c, s));
    return leg.q + (std::abs(middle - half) < std::abs(middle + half) ? middle - half : middle + half);
  };
  return machine;
}

Machine hexapod() {
  Machine machine;
  for (int k = 0; k < 6; ++k) {
    const double pair = (k / 2) * kThird, apart = (k % 2 == 0 ? -1.0 : 1.0);
    const Vector3d lower = around(420.0, pair + 0.2 * apart, 600.0);
    const Vector3d upper = around(180.0, pair + 0.85 * apart, 0.0);
    machine.legs.push_back({LegKind::strut, (upper - lower).norm(), lower, upper, {0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}});
  }
  machine.joint = [](const Leg& leg, const Vector3d& upper) { return (upper - leg.lower).norm(); };
  return machine;
}

Vector3d somewhere(std::mt19937_64& random, double size) {
  return {uniform(random, -size, size), uniform(random, -size, size), uniform(random, -size, size)};
}

class Platform : public testing::TestWithParam<Machine (*)()> {
 protected:
  bool turns() const { return machine_.legs.size() == 6; }
  Matrix3d turn(std::mt19937_64& random) const {
    if (!turns()) return Matrix3d::Identity();
    return Eigen::AngleAxisd{uniform(random, -0.35, 0.35), somewhere(random, 1.0).normalized()}.matrix();
  }

  const Machine machine_ = GetParam()();
  const ParallelKinematics kinematics_ = machine_.kinematics();
};

// Legs in pairs tell their delays apart only where the platform stands otherwise from touch to touch.
Matrix3d tilted(const Machine& machine, const Vector3d& from_centre) {
  if (machine.legs.size() != 6) return Matrix3d::Identity();
  return Eigen::AngleAxisd{0.4 * from_centre.normalized().y(), Vector3d::UnitX()} *
         Eigen::AngleAxisd{0.4 * from_centre.normalized().z(), Vector3d::UnitY()}.matrix();
}

TEST_P(Platform, IsWhereItsJointsPutIt) {
  std::mt19937_64 random{1};
  for (int trial = 0; trial < 200; ++trial) {
    const Vector3d place = machine_.tip + somewhere(random, 110.0);
    const auto found = kinematics_.reached(machine_.at(place, turn(random)));
    ASSERT_TRUE(found) << "trial " << trial;
    EXPECT_LT((*found - place).norm(), 1e-8);
  }
}

TEST_P(Platform, HasTheDerivativesOfItsPlace) {
  std::mt19937_64 random{2};
  for (int trial = 0; trial < 20; ++trial) {
    const VectorXd q = machine_.at(machine_.tip + somewhere(random, 80.0), turn(random));
    const Eigen::Matrix3Xd jacobian = kinematics_.jacobian(q);
    for (Eigen::Index k = 0; k < q.size(); ++k) {
      const double step = machine_.legs[0].kind == LegKind::crank ? 1e-5 : 1e-3;
      const VectorXd by = step * VectorXd::Unit(q.size(), k);
      const Vector3d numeric = (kinematics_.tip(q + by) - kinematics_.tip(q - by)) / (2.0 * step);
      EXPECT_LT((jacobian.col(k) - numeric).norm(), 1e-5 * std::max(1.0, numeric.norm()));
    }
  }
}

// What it says of joint positions far from its reference either fits all legs or is nothing.
TEST_P(Platform, IsNowhereWithJointsThatDoNotMeet) {
  std::mt19937_64 random{3};
  const double far = machine_.legs[0].kind == LegKind::crank ? 2.5 : 900.0;
  int nowhere = 0;
  for (int trial = 0; trial < 100; ++trial) {
    VectorXd q = machine_.at(machine_.tip);
    for (double& one : q) one += uniform(random, -far, far);
    const auto found = kinematics_.reached(q);
    nowhere += found ? 0 : 1;
    if (!found || turns()) continue;
    for (std::size_t k = 0; k < machine_.legs.size(); ++k) {
      const Leg& leg = machine_.legs[k];
      const Vector3d strut = *found + leg.upper - machine_.tip - leg.lowerAt(q[static_cast<Eigen::Index>(k)]);
      EXPECT_NEAR(strut.norm(), (leg.upper - leg.lower).norm(), 1e-9);
    }
  }
  EXPECT_GT(nowhere, 0);
}

Dataset measured(const Machine& machine, const simulation::Scene& scene, std::uint64_t seed) {
  // The simulation moves three joints: a hexapod's other three are taken in a second run of the same touches.
  simulation::Scene simulated = scene;
  const auto joints = [&](const Vector3d& at) { return machine.at(at, tilted(machine, at - scene.centre_mm)); };
  simulated.inverse = [&](const Vector3d& at) { return Vector3d{joints(at).head<3>()}; };
  std::mt19937_64 random{seed};
  Dataset dataset = simulation::measure(simulated, random);
  auto& columns = tableNamed(dataset, "machine").columns;
  if (machine.legs.size() == 6) {
    simulated.inverse = [&](const Vector3d& at) { return Vector3d{joints(at).tail<3>()}; };
    std::mt19937_64 again{seed};
    const Dataset others = simulation::measure(simulated, again);
    for (const char* name : {"x_mm", "y_mm", "z_mm"}) columns.push_back({name, *others.table("machine")->column(name)});
  }
  const auto names = machine.kinematics().columns();
  for (std::size_t k = 0; k < names.size(); ++k) columns[2 + k].name = names[k];
  Table& legs = addTable(
      dataset, "legs",
      {"kind", "q", "lx_mm", "ly_mm", "lz_mm", "px_mm", "py_mm", "pz_mm", "ux", "uy", "uz", "cx_mm", "cy_mm", "cz_mm"});
  for (const auto& leg : machine.legs) {
    const auto& [kind, q, l, p, u, c] = leg;
    legs.append({static_cast<double>(kind), q, l.x(), l.y(), l.z(), p.x(), p.y(), p.z(), u.x(), u.y(), u.z(), c.x(),
                 c.y(), c.z()});
  }
  dataset.config["tip_mm"] = std::vector<double>{machine.tip.x(), machine.tip.y(), machine.tip.z()};
  dataset.config["delays"] = std::string{"each-joint"};
  return dataset;
}

simulation::Scene scene(const Machine& machine) {
  simulation::Scene scene = simulation::perAxis();
  scene.method = "delay-joints";
  scene.centre_mm = machine.tip + Vector3d{35.0, -20.0, -30.0};
  for (const double x : {-1.0, 1.0}) {
    for (const double y : {-1.0, 1.0}) {
      for (const double z : {-1.0, 1.0}) scene.normals.push_back(Vector3d{x, y, z}.normalized());
    }
  }
  return scene;
}

TEST_P(Platform, TellsTheDelayOfEveryJoint) {
  simulation::Scene simulated = simulation::withoutNoise(scene(machine_));
  simulated.bounce_mm = 0.0;
  simulated.more_delay_s = {0.0007, -0.0012, 0.0021};
  const auto solved = solve(measured(machine_, simulated, 3));
  ASSERT_TRUE(solved.ok()) << solved.error().reason;
  const auto& tau = solved->find("tau_joint_s")->values;
  ASSERT_EQ(tau.size(), machine_.legs.size());
  for (std::size_t k = 0; k < tau.size(); ++k) {
    EXPECT_NEAR(tau[k], simulated.tauOf(static_cast<Eigen::Index>(k % 3)), 3e-7) << k;
  }
  for (std::size_t k = 0; k < 3; ++k) {
    EXPECT_NEAR(solved->find("centre_mm")->values[k], simulated.centre_mm[static_cast<Eigen::Index>(k)], 1e-5);
  }
}

INSTANTIATE_TEST_SUITE_P(Kinds, Platform, testing::Values(&slides, &cranks, &hexapod));

TEST(DelayJoints, OfADeltaAreAsUncertainAsItSays) {
  const Machine machine = slides();
  std::mt19937_64 random{4};
  Moments pulls;
  for (std::uint64_t trial = 0; trial < runs(60); ++trial) {
    simulation::Scene simulated = scene(machine);
    simulated.speeds_mm_s = {10.0, 30.0};
    for (double& more : simulated.more_delay_s) more = uniform(random, -0.001, 0.003);
    const auto solved = solve(measured(machine, simulated, random()));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto& tau = *solved->find("tau_joint_s");
    for (std::size_t k = 0; k < 3; ++k) {
      pulls.add(tau.values[k] - simulated.tauOf(static_cast<Eigen::Index>(k)), tau.sd[k]);
    }
  }
  expectHonest(pulls);
  EXPECT_LT(std::abs(pulls.bias()), 4.0);
}

// At one speed the size stands for the delay: a diameter in place of a radius, or in other units, is a delay of
// seconds, at which the joints are where no pose has them. Two speeds tell the size, and that the stated one is wrong.
TEST(DelayJoints, OfADeltaAreRefusedWithASizeFarFromTheTouchedOne) {
  const Machine machine = slides();
  simulation::Scene simulated = scene(machine);
  simulated.speeds_mm_s = {10.0, 25.0};
  Dataset two_speeds = measured(machine, simulated, 6);
  two_speeds.config["effective_diameter_mm"] = 62.0;
  const auto warned = solve(two_speeds);
  ASSERT_TRUE(warned.ok()) << warned.error().reason;
  EXPECT_TRUE(std::ranges::any_of(warned->warnings, [](const auto& each) { return each.starts_with("static-error"); }));
  simulated.speeds_mm_s = {25.0};
  Dataset dataset = measured(machine, simulated, 6);
  for (const double times : {2.0, 3.0, 10.0, 32.0, 1000.0}) {
    dataset.config["effective_diameter_mm"] = 31.0 * times;
    EXPECT_NE(refusalOf(dataset), "") << times;
  }
  const auto solved = solve(dataset);
  ASSERT_FALSE(solved.ok());
  EXPECT_EQ(solved.error().name, "not-reachable");
  EXPECT_THAT(solved.error().reason, HasSubstr("effective_diameter_mm"));
}

TEST(ParallelKinematics, HasNoTipWhereThereIsNoPose) {
  const Machine machine = slides();
  const auto kinematics = machine.kinematics();
  const VectorXd far = machine.at(machine.tip) + Vector3d{5000.0, 0.0, 0.0};
  ASSERT_FALSE(kinematics.reached(far));
  EXPECT_TRUE(kinematics.tip(far).array().isNaN().all());
  EXPECT_TRUE(kinematics.jacobian(far).array().isNaN().all());
}

TEST(DelayJoints, RefusesLegsThatCarryNoPlatform) {
  const Machine machine = slides();
  const Dataset dataset = measured(machine, scene(machine), 5);
  const auto refusal = [](Dataset changed) {
    const auto solved = solve(std::move(changed));
    return solved.ok() ? std::string{} : solved.error().name + ": " + solved.error().reason;
  };
  EXPECT_EQ(refusal(dataset), "");
  Dataset few = dataset;
  for (auto& column : tableNamed(few, "legs").columns) column.values.pop_back();
  EXPECT_THAT(refusal(few), testing::AllOf(HasSubstr("bad-legs"), HasSubstr("2 rows")));
  Dataset flat = dataset;  // three arms in the plane of the platform
  for (double& z : columnNamed(flat, "legs", "lz_mm")) z = 0.0;
  EXPECT_THAT(refusal(flat), HasSubstr("constrain"));
  Dataset strange = dataset;
  columnNamed(strange, "legs", "kind")[1] = 4.0;
  EXPECT_THAT(refusal(strange), testing::AllOf(HasSubstr("bad-flag: "), HasSubstr("'legs'"), HasSubstr("row 2")));
  Dataset slanted = dataset;
  columnNamed(slanted, "legs", "uz")[2] = -0.9;
  EXPECT_THAT(refusal(slanted), testing::AllOf(HasSubstr("bad-direction: "), HasSubstr("'legs'"), HasSubstr("row 3")));
  Dataset far = dataset;
  columnNamed(far, "machine", "q2_mm")[7] += 1500.0;
  EXPECT_THAT(refusal(far), testing::AllOf(HasSubstr("not-reachable: "), HasSubstr("'machine'"), HasSubstr("row 8")));
  Dataset both = dataset;
  addTable(both, "chain", {"revolute"}).append({1.0});
  EXPECT_THAT(refusal(both), HasSubstr("keep"));
}

}  // namespace
}  // namespace probebox::metrology
