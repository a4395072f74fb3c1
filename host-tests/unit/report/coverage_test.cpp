#include "tools/report/coverage.hpp"

#include <cmath>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>

namespace probebox::report {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// JCGM 100:2008, table G.2 (95.45 % at these k), and closed forms for 1, 2 and 4 degrees of freedom.
TEST(Coverage, IsThatOfStudentsT) {
  EXPECT_NEAR(coverageProbability(2, kInfinite), 0.954500, 1e-6);
  EXPECT_NEAR(coverageProbability(2, 1), 2 / std::numbers::pi * std::atan(2.0), 1e-9);
  EXPECT_NEAR(coverageProbability(2, 2), 2 / std::sqrt(6.0), 1e-9);
  EXPECT_NEAR(coverageProbability(2, 4), 0.883883, 1e-6);
  for (const auto& [dof, k] : {std::pair{1.0, 13.97}, {5.0, 2.65}, {10.0, 2.28}, {20.0, 2.13}, {50.0, 2.05}})
    EXPECT_NEAR(coverageProbability(k, dof), 0.9545, 0.0006) << dof;
  EXPECT_NEAR(coverageProbability(2, 1e5), coverageProbability(2, kInfinite), 1e-5);
}

TEST(Coverage, CombinesDegreesOfFreedomByWelchAndSatterthwaite) {
  metrology::Result result;
  result.dof = 6;
  metrology::Estimate estimate{.key = "a_mm", .values = {1, 2, 3}, .sd = {1, 1, 0}, .uncertainty = {1, 2, 5}};
  EXPECT_EQ(effectiveDof(result, estimate, 0), 6);
  EXPECT_NEAR(effectiveDof(result, estimate, 1), 6 * std::pow(1 + 3 * 1.5, 2), 1e-9) << "type A as s, not as sd of t";
  EXPECT_EQ(effectiveDof(result, estimate, 2), kInfinite) << "type B alone";
  result.chi2_reduced = 1.1;
  EXPECT_EQ(effectiveDof(result, estimate, 0), kInfinite) << "the noise was stated";
  result.also = {metrology::Estimate::scalar("noise_dof", 40, std::nullopt)};
  EXPECT_EQ(effectiveDof(result, estimate, 0), 40);
}

// Of an answer that was read from a file.
TEST(Coverage, IsWidestWhereAnAnswerHasNoSensibleDegreesOfFreedom) {
  metrology::Result result;
  result.chi2_reduced = 1.1;
  const metrology::Estimate estimate{.key = "a_mm", .values = {1}, .sd = {1}, .uncertainty = {1}};
  for (const double dof : {-1e308, -3.0, 0.0, 0.5, std::numeric_limits<double>::quiet_NaN()}) {
    result.also = {metrology::Estimate::scalar("noise_dof", dof, std::nullopt)};
    EXPECT_EQ(effectiveDof(result, estimate, 0), 1) << dof;
    EXPECT_EQ(dofText(effectiveDof(result, estimate, 0)), "1") << dof;
  }
}

// The sd holds what a table that stood still is off, which has no degrees of freedom of these readings.
TEST(Coverage, TakesOnlyTheReadingsForTypeA) {
  metrology::Result result;
  result.dof = 6;
  const metrology::Estimate other{.key = "b_mm", .values = {1}, .sd = {1}, .uncertainty = {1}},
      estimate{.key = "a_mm", .values = {1}, .sd = {2}, .uncertainty = {2}};
  result.estimates = {other, estimate};
  result.budget = {{"readings", false, {1, 1}}, {"stop_of_table", true, {0, std::sqrt(3.0)}}};
  EXPECT_EQ(effectiveDof(result, other, 0), 6);
  EXPECT_NEAR(effectiveDof(result, estimate, 0), 6 * std::pow(1 + 3 * 1.5, 2), 1e-9);
  EXPECT_GT(coverageOf(result, estimate, 0, 2), coverageOf(result, other, 0, 2) - 0.006);
  result.budget[0].sd[1] = 0;
  EXPECT_EQ(effectiveDof(result, estimate, 0), kInfinite) << "the stop alone";
}

// u of the residuals is the sd of t, so that k = 2 covers about 95 % from three degrees of freedom on.
TEST(Coverage, OfTwoStandardDeviationsOfTIsThatOfTheNormalDistribution) {
  const metrology::Estimate alone{.key = "a_mm", .values = {1}, .sd = {1}, .uncertainty = {1}};
  for (const std::size_t dof : {3U, 4U, 6U, 10U, 30U, 1000U}) {
    metrology::Result result;
    result.dof = dof;
    const double n = static_cast<double>(dof);
    EXPECT_NEAR(coverageOf(result, alone, 0, 2), coverageProbability(2 * std::sqrt(n / (n - 2)), n), 1e-9);
    EXPECT_NEAR(coverageOf(result, alone, 0, 2), 0.9545, 0.006) << dof;
    // With type B as large, whose noise is not Student's, it covers more.
    const metrology::Estimate both{.key = "a_mm", .values = {1}, .sd = {1}, .uncertainty = {std::sqrt(2.0)}};
    EXPECT_GT(coverageOf(result, both, 0, 2), 0.9535) << dof;
    EXPECT_LT(coverageOf(result, both, 0, 2), 0.985) << dof;
  }
}

// As many readings as unknowns leave no chi-square: their sd is then known from the stated noise alone.
TEST(Coverage, OfStatedNoiseWithoutSpareReadingsIsThatOfTheNormalDistribution) {
  const metrology::Result result;
  const metrology::Estimate estimate{.key = "a_mm", .values = {1}, .sd = {1}, .uncertainty = {2}};
  ASSERT_EQ(result.dof, 0);
  EXPECT_EQ(effectiveDof(result, estimate, 0), kInfinite);
  EXPECT_NEAR(coverageProbability(2, effectiveDof(result, estimate, 0)), 0.9545, 1e-4);
}

}  // namespace
}  // namespace probebox::report
