// A probe whose spindle was turned while the delay was measured: its gain is that of the probe at A = 0 all the same.
#include "firmware/metrology/dataset/probe_pose.hpp"

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <numbers>

#include "firmware/metrology/solve.hpp"
#include "host-tests/metrology/touch_simulation.hpp"

namespace probebox::metrology {
namespace {

using simulation::Scene;

const Eigen::Matrix3d kGainAtZero{{0.98, 0.01, -0.005}, {-0.012, 1.03, 0.004}, {0.006, -0.008, 1.01}};

Dataset measuredAt(double spindle_rad, Scene scene) {
  const Eigen::AngleAxisd turn{spindle_rad, Eigen::Vector3d::UnitZ()};
  scene.gain = turn.toRotationMatrix() * kGainAtZero;
  std::mt19937_64 random{31};
  return simulation::measure(scene, random);
}

double farthestFromTruth(const Result& result) {
  const auto& gain = *result.find("gain_matrix");
  double most = 0;
  for (std::size_t k = 0; k < 9; ++k) {
    const double truth = kGainAtZero(static_cast<Eigen::Index>(k / 3), static_cast<Eigen::Index>(k % 3));
    most = std::max(most, std::abs(gain.values[k] - truth) / gain.sd[k]);
  }
  return most;
}

TEST(GainOfATurnedProbe, IsTurnedBackFromTheStatedAngle) {
  for (const Scene& scene : {simulation::knownSphere(), simulation::perAxis(), Scene{}}) {
    for (const double turned_deg : {0.0, 37.0, 90.0, 180.0, 270.0}) {
      const double turned_rad = turned_deg * std::numbers::pi / 180;
      Dataset dataset = measuredAt(turned_rad, scene);
      const auto unknown = solve(dataset);
      ASSERT_TRUE(unknown) << unknown.error().reason;
      EXPECT_EQ(unknown->find(kGainTakenAt), nullptr) << "a box does not use it";

      dataset.config["A_rad"] = turned_rad;
      const auto stated = solve(dataset);
      ASSERT_TRUE(stated) << stated.error().reason;
      EXPECT_LT(farthestFromTruth(*stated), 4.5) << dataset.method << " at " << turned_deg;
      EXPECT_EQ(stated->find(kGainTakenAt)->value(), turned_rad);

      dataset.config["A_sense"] = -1.0;
      dataset.config["A_rad"] = -turned_rad;
      EXPECT_LT(farthestFromTruth(solve(dataset).value()), 4.5);
    }
  }
}

TEST(GainOfATurnedProbe, IsRefusedWhereTheHeadHadSwivelled) {
  Dataset dataset = measuredAt(0, simulation::knownSphere());
  dataset.config["B_rad"] = 0.001;
  EXPECT_TRUE(solve(dataset)) << "within what counts as level";
  dataset.config["B_rad"] = 0.02;
  EXPECT_EQ(solve(dataset).error().name, "head-swivelled");
}

}  // namespace
}  // namespace probebox::metrology
