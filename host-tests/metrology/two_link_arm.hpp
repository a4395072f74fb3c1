#pragma once
#include <Eigen/Geometry>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "firmware/metrology/kinematics/joint_chain.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/touch_simulation.hpp"

// A machine whose axes are joints of a chain: an arm with two links in the plane and a quill along Z.
namespace probebox::metrology {

struct Arm {
  Eigen::Vector3d base{0.0, 0.0, 0.0};
  double upper{300.0};
  double fore{250.0};

  Eigen::Vector3d tip() const { return base + Eigen::Vector3d{upper + fore, 0.0, 0.0}; }
  std::vector<Joint> joints() const {
    return {{true, base, Eigen::Vector3d::UnitZ()},
            {true, base + Eigen::Vector3d{upper, 0.0, 0.0}, Eigen::Vector3d::UnitZ()},
            {false, base, Eigen::Vector3d::UnitZ()}};
  }
  // Elbow to the right.
  Eigen::Vector3d inverse(const Eigen::Vector3d& at) const {
    const Eigen::Vector3d arm = at - base;
    const double reach = arm.head<2>().norm();
    const double elbow = std::acos((reach * reach - upper * upper - fore * fore) / (2.0 * upper * fore));
    const double shoulder =
        std::atan2(arm.y(), arm.x()) - std::atan2(fore * std::sin(elbow), upper + fore * std::cos(elbow));
    return {shoulder, elbow, arm.z()};
  }
};

inline void describe(Dataset& dataset, const std::vector<Joint>& joints, const Eigen::Vector3d& tip) {
  Table& chain = addTable(dataset, "chain", {"revolute", "px_mm", "py_mm", "pz_mm", "ux", "uy", "uz"});
  for (const auto& joint : joints) {
    const auto& p = joint.point;
    const auto& u = joint.direction;
    chain.append({joint.revolute ? 1.0 : 0.0, p.x(), p.y(), p.z(), u.x(), u.y(), u.z()});
  }
  dataset.config["tip_mm"] = std::vector<double>{tip.x(), tip.y(), tip.z()};
  const auto names = JointChain{joints, tip}.columns();
  for (std::size_t k = 0; k < names.size(); ++k) tableNamed(dataset, "machine").columns[2 + k].name = names[k];
}

inline simulation::Scene scene(const Arm& arm) {
  simulation::Scene scene = simulation::perAxis();
  scene.method = "delay-joints";
  scene.centre_mm = arm.base + Eigen::Vector3d{330.0, 140.0, -60.0};
  scene.inverse = [arm](const Eigen::Vector3d& at) { return arm.inverse(at); };
  scene.sigma_share = {1.0 / 350.0, 1.0 / 250.0, 1.0};
  return scene;
}

inline Dataset measured(const simulation::Scene& scene, const Arm& arm, std::mt19937_64& random) {
  Dataset dataset = simulation::measure(scene, random);
  describe(dataset, arm.joints(), arm.tip());
  dataset.config["delays"] = std::string{"each-joint"};
  return dataset;
}

}  // namespace probebox::metrology
