// A shoulder, an elbow and a quill: where the tip is, in closed form.
#include "firmware/metrology/kinematics/joint_chain.hpp"

#include <cmath>
#include <gtest/gtest.h>

#include "host-tests/metrology/cases.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kUpper_mm = 300, kFore_mm = 250;
const Vector3d kBase{20, -30, 5};

JointChain arm() {
  Dataset dataset{.method = "delay-joints", .config = {}, .tables = {}};
  const Vector3d elbow = kBase + Vector3d{kUpper_mm, 0, 0}, tip = elbow + Vector3d{kFore_mm, 0, 0};
  Table& chain = addTable(dataset, "chain", {"revolute", "px_mm", "py_mm", "pz_mm", "ux", "uy", "uz"});
  chain.append({1, kBase.x(), kBase.y(), kBase.z(), 0, 0, 1});
  chain.append({1, elbow.x(), elbow.y(), elbow.z(), 0, 0, 1});
  chain.append({0, 0, 0, 0, 0, 0, -1});
  dataset.config["tip_mm"] = std::vector{tip.x(), tip.y(), tip.z()};
  auto read = JointChain::read(dataset);
  EXPECT_TRUE(read.ok()) << read.error().reason;
  return std::move(read).value();
}

Vector3d tipOf(const VectorXd& q) {
  return kBase + Vector3d{kUpper_mm * std::cos(q[0]) + kFore_mm * std::cos(q[0] + q[1]),
                          kUpper_mm * std::sin(q[0]) + kFore_mm * std::sin(q[0] + q[1]), -q[2]};
}

TEST(JointChain, IsWhereItsJointsPutIt) {
  const auto chain = arm();
  EXPECT_EQ(chain.columns(), (std::vector<std::string>{"q1_rad", "q2_rad", "q3_mm"}));
  std::mt19937_64 random{1};
  for (int trial = 0; trial < 20; ++trial) {
    const VectorXd q = anywhere(random, 2);
    EXPECT_LT((*chain.reached(q) - tipOf(q)).norm(), 1e-9);
    for (Eigen::Index joint = 0; joint < 3; ++joint) {
      constexpr double kStep = 1e-5;
      VectorXd on = q, back = q;
      on[joint] += kStep;
      back[joint] -= kStep;
      const Vector3d slope = (tipOf(on) - tipOf(back)) / (2 * kStep);
      EXPECT_LT((chain.jacobian(q).col(joint) - slope).norm(), 1e-5) << joint;
    }
  }
}

}  // namespace
}  // namespace probebox::metrology
