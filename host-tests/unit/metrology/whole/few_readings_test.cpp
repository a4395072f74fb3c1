// Without a stated sigma the sd comes from few residuals. It is that of Student's t, so that errors over it have the
// variance 1, and twice the sd covers 95 %, for every method and number of readings.
#include <cmath>
#include <numbers>

#include "host-tests/metrology/cases.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;

constexpr int kTrials = 4000;
constexpr double kSigma_mm = 0.001;

// Errors of one promised value over its sd, with n degrees of freedom.
struct FewReadings {
  std::size_t dof{};
  Moments pulls{};
  int within{};

  void add(const Solved& solved, std::string_view key, std::size_t at, double truth) {
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    ASSERT_EQ(solved->dof, dof);
    const auto& estimate = *solved->find(key);
    ASSERT_FALSE(estimate.sd.empty());
    const double error = estimate.values[at] - truth;
    pulls.add(error, estimate.sd[at]);
    if (std::abs(error) < 2 * estimate.uncertainty[at]) ++within;
  }
  void expectStudent() const {
    const double n = static_cast<double>(dof);
    // The fourth moment of t is infinite up to four degrees: its mean square tells nothing there.
    if (dof > 4) {
      const double spread = std::sqrt((3 * (n - 2) / (n - 4) - 1) / kTrials);
      EXPECT_NEAR(pulls.pull(), 1, 5 * spread) << dof;
    }
    EXPECT_NEAR(within / static_cast<double>(kTrials), 0.953, 0.02) << dof;
  }
};

TEST(FewReadings, OfACentreline) {
  std::mt19937_64 random{31};
  FewReadings eight{8}, four{4};
  for (int trial = 0; trial < kTrials; ++trial) {
    for (auto* few : {&eight, &four}) {
      const int angles = few->dof == 8 ? 6 : 4;
      Dataset dataset{.method = "centreline", .config = {}, .tables = {}};
      stateExactMachine(dataset);
      Table& table = addTable(dataset, "readings", {"C_rad", "x_mm", "y_mm"});
      for (int k = 0; k < angles; ++k) {
        const double c = 2 * std::numbers::pi * k / angles;
        table.append(
            {c, 0.3 + 20 * std::cos(c) + gauss(random, kSigma_mm), -0.2 + 20 * std::sin(c) + gauss(random, kSigma_mm)});
      }
      few->add(solve(dataset), "centre_mm", 0, 0.3);
    }
  }
  eight.expectStudent();
  four.expectStudent();
}

TEST(FewReadings, OfASphere) {
  std::mt19937_64 random{32};
  FewReadings six{6}, three{3};
  for (int trial = 0; trial < kTrials; ++trial) {
    for (auto* few : {&six, &three}) {
      Dataset dataset{.method = "sphere-fit", .config = {}, .tables = {}};
      stateExactMachine(dataset);
      Table& table = addTable(dataset, "points", {"x_mm", "y_mm", "z_mm"});
      const int points = few->dof == 6 ? 10 : 7;
      for (int k = 0; k < points; ++k) {
        const double turn = 2.4 * k, up = 0.05 + 0.9 * k / points;
        const double out = std::sqrt(1 - up * up), radius = 12.5 + gauss(random, kSigma_mm);
        table.append({1 + radius * out * std::cos(turn), 2 + radius * out * std::sin(turn), 3 + radius * up});
      }
      few->add(solve(dataset), "centre_mm", 0, 1);
    }
  }
  six.expectStudent();
  three.expectStudent();
}

TEST(FewReadings, OfAnAssembledTool) {
  std::mt19937_64 random{33};
  FewReadings six{6}, three{3};
  for (int trial = 0; trial < kTrials; ++trial) {
    for (auto* few : {&six, &three}) {
      Dataset dataset{.method = "tool-assembly", .config = {{"L1_mm", 85.0}, {"L2_mm", 142.5}}, .tables = {}};
      stateExactMachine(dataset);
      Table& table = addTable(dataset, "readings", {"workpiece_variant", "rep", "W0_x_mm", "W0_y_mm", "L0_z_mm"});
      for (int rep = 0; rep < (few->dof == 6 ? 3 : 2); ++rep)
        table.append({0.0, static_cast<double>(rep), -0.04 + gauss(random, kSigma_mm), 0.05 + gauss(random, kSigma_mm),
                      145.25 + gauss(random, kSigma_mm)});
      few->add(solve(dataset), "compensation_mm", 2, 2.75);
    }
  }
  six.expectStudent();
  three.expectStudent();
}

// Student's t with one or two degrees of freedom has no sd.
TEST(FewReadings, GiveNoSdUpToTwoDegreesOfFreedom) {
  std::mt19937_64 random{34};
  Dataset dataset{.method = "spindle-offset-2x2", .config = {}, .tables = {}};
  stateExactMachine(dataset);
  Table& table = addTable(dataset, "readings", {"A_rad", "C_rad", "x_mm", "y_mm"});
  for (const double a : {0.0, std::numbers::pi}) {
    for (const double c : {0.0, std::numbers::pi})
      table.append({a, c, 0.1 + 15 * std::cos(c) - 0.02 * std::cos(a) + gauss(random, kSigma_mm),
                    0.2 + 5 * std::cos(c) + 0.01 * std::cos(a) + gauss(random, kSigma_mm)});
  }
  const auto unknown = solve(dataset);
  ASSERT_TRUE(unknown.ok()) << unknown.error().reason;
  EXPECT_EQ(unknown->dof, 2U);
  EXPECT_TRUE(unknown->find("offset_C_minus_A_mm")->sd.empty());
  EXPECT_THAT(unknown->warnings, testing::Contains(testing::HasSubstr("no sigma")));
  dataset.config["sigma_mm"] = kSigma_mm;
  EXPECT_FALSE(solve(dataset)->find("offset_C_minus_A_mm")->sd.empty());
}

}  // namespace
}  // namespace probebox::metrology
