#include "firmware/metrology/scan/scan_gain.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "firmware/metrology/solve.hpp"
#include "host-tests/metrology/scan_simulation.hpp"

// The gain of a probe from scans around a ball.
namespace probebox::metrology {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;
using simulation::ScanScene;

// Only the lengths of deflections count, and one factor of all of them says nothing: A'A in the plane, over its mean.
Eigen::Matrix2d lengthsOf(const Matrix3d& gain) {
  const Eigen::Matrix2d squares = (gain.transpose() * gain).topLeftCorner<2, 2>();
  return squares / (squares.trace() / 2);
}

TEST(ScanGain, FindsHowTheDirectionsDiffer) {
  std::mt19937_64 random{7};
  std::normal_distribution<double> normal{0.0, 0.02};
  for (int round = 0; round < 10; ++round) {
    ScanScene scene;
    scene.tau_s = -0.004 + 0.001 * round;
    scene.centre_error_mm = {0.008, -0.005, 0.002};
    scene.inner_mm = 15.0;
    for (Eigen::Index row = 0; row < 2; ++row)
      for (Eigen::Index column = 0; column < 2; ++column) scene.gain(row, column) += normal(random);
    auto dataset = measure(scene, random);
    const Vector3d centre{std::get<std::vector<double>>(dataset.config["centre_mm"]).data()};
    const auto found = scanGain(dataset, centre, Matrix3d::Identity());
    ASSERT_TRUE(found);
    EXPECT_LT((lengthsOf(*found) - lengthsOf(scene.gain)).cwiseAbs().maxCoeff(), 3e-4) << round;
    // Solved with it the delay is right, where the described one leaves an error or no answer.
    Matrix rows;
    for (const auto& row : found->rowwise()) rows.emplace_back(row.begin(), row.end());
    dataset.config["gain_matrix"] = rows;
    const auto solved = solve(dataset);
    ASSERT_TRUE(solved) << solved.error().reason;
    const auto& tau = *solved->find("tau_s");
    EXPECT_LT(std::abs(tau.value() - scene.tau_s), 4 * *tau.standardDeviation()) << round;
  }
}

// Turning the channels changes no length.
TEST(ScanGain, KeepsTheDescribedSenseOfTheChannels) {
  std::mt19937_64 random{8};
  ScanScene scene;
  scene.gain = Eigen::AngleAxisd{0.7, Vector3d::UnitZ()}.toRotationMatrix();
  const auto dataset = measure(scene, random);
  const auto found = scanGain(dataset, scene.centre_mm, scene.gain);
  ASSERT_TRUE(found);
  EXPECT_LT((*found - scene.gain).cwiseAbs().maxCoeff(), 2e-3);
}

TEST(ScanGain, SaysNothingOfNoScansAtAllOrOfAProbeThatFeelsNothing) {
  EXPECT_FALSE(
      scanGain({.method = "delay-stepped-scan", .config = {}, .tables = {}}, Vector3d::Zero(), Matrix3d::Identity()));
  std::mt19937_64 random{9};
  auto dataset = measure(ScanScene{}, random);
  for (auto& table : dataset.tables) {
    if (table.name != "probe") continue;
    for (std::size_t channel = 2; channel < 5; ++channel) std::ranges::fill(table.columns[channel].values, 0.0);
  }
  EXPECT_FALSE(scanGain(dataset, ScanScene{}.centre_mm, Matrix3d::Identity()));
  for (auto& table : dataset.tables)
    for (auto& column : table.columns) column.values.clear();
  EXPECT_FALSE(scanGain(dataset, ScanScene{}.centre_mm, Matrix3d::Identity()));
}

}  // namespace
}  // namespace probebox::metrology
