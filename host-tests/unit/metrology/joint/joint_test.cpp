// Delay, turning axis, screws and drift from the touches of a shift, against the answers of each by itself.
#include "firmware/metrology/joint/joint.hpp"

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>

#include "firmware/metrology/fit/least_squares.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/shift_simulation.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::Vector3d;
using testing::HasSubstr;

TEST(Joint, StatesItsUncertaintyOfAllTogether) {
  std::mt19937_64 random{11};
  std::map<std::string, Moments> errors;
  for (int trial = 0; trial < 100; ++trial) {
    const SimulatedShift shift;
    Vector2d centre;
    const auto solved = solveJoint(shift.dataset(random, &centre));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto add = [&](const char* key, std::size_t component, double truth) {
      const auto* found = solved->find(key);
      errors[key].add(found->values[component] - truth, found->sd[component]);
    };
    add("tau_s", 0, shift.tau_s);
    add("K_x", 0, shift.gain_x);
    add("K_z", 0, shift.gain_z);
    for (std::size_t k = 0; k < 2; ++k) {
      add("centre_mm", k, centre[static_cast<Index>(k)]);
      add("C_tilt_rad", k, shift.tilt_rad[static_cast<Index>(k)]);
    }
    for (std::size_t k = 0; k < 3; ++k) add("drift_rate_um_per_min", k, shift.drift_um_per_min[static_cast<Index>(k)]);
    EXPECT_EQ(solved->find("K_y"), nullptr);
    ASSERT_TRUE(solved->covariance);
    EXPECT_EQ(solved->covariance->components.size(), 10U);
  }
  for (const auto& [key, moments] : errors) {
    SCOPED_TRACE(key);
    expectHonest(moments);
  }
}

constexpr Index kSides = 5;

// Touches of one ball at one angle of one round, as poses of their own.
struct OfPoses {
  Eigen::MatrixXd design;
  Eigen::VectorXd values;
};

// Each pose has a place of its own; delay and size are common.
OfPoses apart(const Table& table, double sigma_mm) {
  const auto rows = static_cast<Index>(table.rows());
  const Index poses = rows / kSides;
  OfPoses of{Eigen::MatrixXd::Zero(rows, 2 + 3 * poses), Eigen::VectorXd{rows}};
  for (Index row = 0; row < rows; ++row) {
    const auto value = [&](const char* name) { return (*table.column(name))[static_cast<std::size_t>(row)]; };
    const Vector3d n{value("nx"), value("ny"), value("nz")}, at{value("x_mm"), value("y_mm"), value("z_mm")};
    of.design(row, 0) = -value("speed_mm_s");
    of.design(row, 1) = 1;
    of.design.block<1, 3>(row, 2 + 3 * (row / kSides)) = n.transpose();
    of.values[row] = n.dot(at);
  }
  of.design /= sigma_mm;
  of.values /= sigma_mm;
  return of;
}

TEST(Joint, KnowsMoreThanTheAnswersOfEachByItself) {
  std::mt19937_64 random{12};
  const SimulatedShift shift;
  Vector2d truth;
  const Dataset dataset = shift.dataset(random, &truth);
  const Table& table = dataset.tables[0];
  const auto joint = solve(dataset);
  ASSERT_TRUE(joint.ok()) << joint.error().reason;
  const auto of_poses = apart(table, shift.sigma_mm);
  const auto poses = linearLeastSquares(of_poses.design, of_poses.values);
  ASSERT_TRUE(poses.ok());
  EXPECT_LT(joint->find("tau_s")->sd[0], std::sqrt(poses->cofactor(0, 0)));

  // The axis by the places of one ball, which the screws and the drift move.
  Dataset centreline{.method = "centreline", .config = {}, .tables = {}};
  Table& readings = addTable(centreline, "readings", {"C_rad", "x_mm", "y_mm"});
  for (Index pose = 0; pose < (poses->parameters.size() - 2) / 3; ++pose) {
    const auto row = static_cast<std::size_t>(kSides * pose);
    if ((*table.column("ball"))[row] == 1)
      readings.append(
          {(*table.column("C_rad"))[row], poses->parameters[2 + 3 * pose], poses->parameters[3 + 3 * pose]});
  }
  const auto alone = solve(centreline);
  ASSERT_TRUE(alone.ok()) << alone.error().reason;
  EXPECT_LT(joint->find("centre_mm")->sd[0], alone->find("centre_mm")->sd[0]);
  EXPECT_LT(std::abs(joint->find("centre_mm")->values[0] - truth.x()),
            std::abs(alone->find("centre_mm")->values[0] - truth.x()));
}

TEST(Joint, RefusesWhatItCannotTellApartByName) {
  std::mt19937_64 random{13};
  const auto refusal = [&](const SimulatedShift& shift) { return solve(shift.dataset(random)); };
  SimulatedShift one_speed;
  one_speed.speeds_mm_s = {20, 20};
  Dataset dataset = one_speed.dataset(random);
  const auto single = solve(dataset);
  ASSERT_FALSE(single.ok());
  EXPECT_EQ(single.error().name, "not-separable");
  EXPECT_THAT(single.error().reason, HasSubstr("the delay, the size"));
  dataset.config["effective_diameter_mm"] = 2 * one_speed.radius_mm;
  const auto sized = solve(dataset);
  ASSERT_TRUE(sized.ok()) << sized.error().reason;
  EXPECT_NEAR(sized->find("tau_s")->value(), one_speed.tau_s, 6 * sized->find("tau_s")->sd[0]);

  SimulatedShift even;
  even.warms_evenly = true;
  even.arm_mm = 0.5;  // X stays at one place of its screw
  even.radius_mm = 1;
  const auto as_one = refusal(even);
  ASSERT_FALSE(as_one.ok());
  EXPECT_EQ(as_one.error().name, "not-separable");
  EXPECT_THAT(as_one.error().reason, HasSubstr("the gain of the screw of X, the drift of X"));

  SimulatedShift still;
  still.angles = 1;
  EXPECT_EQ(refusal(still).error().name, "not-separable");

  Dataset cold = SimulatedShift{}.dataset(random);
  for (double& ext : columnNamed(cold, "readings", "ext_x_um")) ext *= 0.05;
  EXPECT_EQ(solve(cold).error().name, "extension-span-too-small");
  Dataset without = SimulatedShift{}.dataset(random);
  without.config.erase("screw_length_z_mm");
  EXPECT_EQ(solve(without).error().name, "missing-key");
}

}  // namespace
}  // namespace probebox::metrology
