// Whether residuals agree with the noise that is stated, or that was learned from other residuals.
#include "firmware/metrology/fit/noise_check.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

#include "firmware/metrology/solve.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/touch_simulation.hpp"
#include "host-tests/support/runs.hpp"
#include "host-tests/support/sanitized.hpp"

namespace probebox::metrology {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::Ge;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Le;
using testing::StartsWith;

constexpr int kSlower = support::kSanitized ? 20 : 1;

// Quantiles 0.0005 and 0.9995, from mpmath 1.2.1 at 30 digits.
TEST(ChiSquare, HasTheQuantilesOfTheTables) {
  struct Known {
    ChiSquareLaw law;
    double low, high;
  };
  for (const auto& [law, low, high] :
       {Known{{1, 0}, 3.92699133e-7, 12.1156651}, Known{{2, 0}, 0.000500125042, 7.60090246},
        Known{{5, 0}, 0.0316275046, 4.42106536}, Known{{20, 0}, 0.269903311, 2.37492259},
        Known{{187, 0}, 0.694289118, 1.37566617}, Known{{1970, 0}, 0.898468992, 1.10818144},
        Known{{1, 94}, 3.94793485e-7, 13.0038437}, Known{{20, 800}, 0.267801548, 2.41901291},
        Known{{5, 6}, 0.0259940846, 26.6452158}, Known{{400, 50}, 0.53054784, 2.19524986},
        Known{{1, 1}, 6.16850529e-7, 1621138.27}}) {
    const auto range = rangeOf(law);
    EXPECT_NEAR(range.low / low, 1.0, 1e-7) << law.dof << " " << law.noise_dof;
    EXPECT_NEAR(range.high / high, 1.0, 1e-7) << law.dof << " " << law.noise_dof;
  }
}

TEST(ChiSquare, OfAMillionResidualsIsThatOfTheNormalLaw) {
  const auto range = rangeOf({.dof = 1'000'000});
  EXPECT_NEAR(range.high - 1.0, 3.2905 * std::sqrt(2e-6), 2e-5);
  EXPECT_NEAR(1.0 - range.low, 3.2905 * std::sqrt(2e-6), 2e-5);
}

std::string_view warningAt(double chi2, ChiSquareLaw law, const Eigen::VectorXd& residuals = {}) {
  return checkNoise(chi2, law, residuals).warning;
}

TEST(NoiseCheck, LooksAtBothSidesAndAtTheDegreesOfFreedom) {
  EXPECT_EQ(warningAt(0.0035, {.dof = 187}), kResidualsBelowNoise);
  EXPECT_EQ(warningAt(1.4, {.dof = 1970}), kResidualsExceedNoise);
  EXPECT_EQ(warningAt(0.0035, {.dof = 1}), "");
  EXPECT_EQ(warningAt(1.4, {.dof = 20}), "");
  EXPECT_EQ(warningAt(0.0, {.dof = 4}), kResidualsBelowNoise) << "readings that agree to the last digit are copies";
  EXPECT_EQ(warningAt(0.0, {.dof = 3}), "") << "so few may agree to their last digit by chance";
  EXPECT_EQ(warningAt(1.7, {.dof = 187}), kResidualsExceedNoise);
  EXPECT_EQ(warningAt(1.7, {.dof = 187, .noise_dof = 40}), "") << "the noise itself is known from 40 residuals alone";
  EXPECT_EQ(warningAt(50.0, {.dof = 0}), "");
}

// Coordinates x and y of 40 readings, interleaved as in a fit.
Eigen::VectorXd rows(double (*of)(int reading, int part)) {
  Eigen::VectorXd all{80};
  for (int k = 0; k < 80; ++k) all[k] = of(k / 2, k % 2);
  return all;
}

TEST(NoiseCheck, WidensForNoiseButNotForAWrongModel) {
  const auto wave = rows([](int reading, int part) { return 3.0 * std::sin(0.31 * reading + 1.6 * part); });
  const auto wrong = checkNoise(4.5, {.dof = 76}, wave);
  EXPECT_EQ(wrong.warning, kResidualsShowAPattern);
  EXPECT_EQ(wrong.widening, 1.0);
  std::mt19937_64 random{5};
  Eigen::VectorXd noise{80};
  for (double& each : noise) each = gauss(random, 2.1);
  const auto noisy = checkNoise(4.5, {.dof = 76}, noise);
  EXPECT_EQ(noisy.warning, kResidualsExceedNoise);
  EXPECT_DOUBLE_EQ(noisy.widening, std::sqrt(4.5));
  EXPECT_EQ(checkNoise(0.2, {.dof = 76}, noise).widening, 1.0) << "an sd is never made smaller";
}

// Noise, and one reading with both of its coordinates far off.
TEST(NoiseCheck, TakesAnOutlierForNoise) {
  std::mt19937_64 random{6};
  int mistaken = 0;
  for (int trial = 0; trial < 1000; ++trial) {
    Eigen::VectorXd residuals{80};
    for (double& each : residuals) each = gauss(random, 1.0);
    residuals[40] = residuals[41] = 30.0;
    mistaken += checkNoise(20.0, {.dof = 76}, residuals).warning == kResidualsExceedNoise ? 0 : 1;
  }
  EXPECT_LE(mistaken, 6) << "one of a thousand expected";
}

TEST(NoiseCheck, SeldomSeesAPatternInNoise) {
  std::mt19937_64 random{7};
  int seen = 0;
  for (int trial = 0; trial < 20000 / kSlower; ++trial) {
    Eigen::VectorXd residuals{60};
    for (double& each : residuals) each = gauss(random, 1.0);
    seen += showPattern(residuals, 58) ? 1 : 0;
  }
  EXPECT_LE(seen * kSlower, 40);
}

// Ten points on a sphere: six degrees of freedom.
Dataset sphere(double stated, double sigma, std::mt19937_64& random) {
  Dataset dataset{.method = "sphere-fit", .config = {{"sigma_mm", stated}}, .tables = {}};
  auto& points = addTable(dataset, "points", {"x_mm", "y_mm", "z_mm"});
  for (int k = 0; k < 10; ++k) {
    Eigen::Vector3d n{uniform(random, -1, 1), uniform(random, -1, 1), uniform(random, -1, 1)};
    n.normalize();
    points.append(
        {12 * n.x() + gauss(random, sigma), 12 * n.y() + gauss(random, sigma), 12 * n.z() + gauss(random, sigma)});
  }
  return dataset;
}

// A feature read at twelve angles of the axis: 20 degrees of freedom.
Dataset turn(double stated, double sigma, std::mt19937_64& random) {
  Dataset dataset{.method = "centreline", .config = {{"sigma_mm", stated}}, .tables = {}};
  auto& readings = addTable(dataset, "readings", {"C_rad", "x_mm", "y_mm"});
  for (int k = 0; k < 12; ++k) {
    const double angle = 0.5236 * k;
    readings.append({angle, 20 * std::cos(angle) + gauss(random, sigma), 20 * std::sin(angle) + gauss(random, sigma)});
  }
  return dataset;
}

bool isNoiseWarning(const std::string& warning) {
  return std::ranges::any_of(std::array{kResidualsExceedNoise, kResidualsBelowNoise, kResidualsShowAPattern},
                             [&](std::string_view name) { return warning.starts_with(name); });
}

TEST(NoiseCheck, WarnsOfOneHonestCaseInAThousand) {
  int above = 0;
  int below = 0;
  for (const auto measure : {sphere, turn}) {
    std::mt19937_64 random{8};
    for (std::uint64_t trial = 0; trial < runs(20000) / kSlower; ++trial) {
      const auto solved = solve(measure(0.001, 0.001, random));
      if (!solved) continue;  // a point further off than a sphere allows
      for (const auto& warning : solved->warnings) {
        below += warning.starts_with(kResidualsBelowNoise) ? 1 : 0;
        above += isNoiseWarning(warning) && !warning.starts_with(kResidualsBelowNoise) ? 1 : 0;
      }
    }
  }
  // On each side one of 2000 is expected, 5 of 10000, give or take the square root.
  if (kSlower == 1) {
    const int least = runsAreComplete() ? 7 : 1, most = runsAreComplete() ? 38 : 13;
    for (const int seen : {below, above}) EXPECT_THAT(seen, AllOf(Ge(least), Le(most)));
  } else {
    EXPECT_LE(below + above, 8);
  }
}

// The noise of the touches is learned within each of them: F with as many degrees of freedom as were found.
TEST(NoiseCheck, KnowsHowWellTheNoiseOfTouchesIsLearned) {
  std::mt19937_64 random{9};
  int outside = 0;
  int warned = 0;
  const std::uint64_t trials = runs(600) / kSlower;
  for (std::uint64_t trial = 0; trial < trials; ++trial) {
    const auto scene = simulation::shuffled({}, random);
    const auto solved = solve(simulation::measure(scene, random));
    ASSERT_TRUE(solved.ok()) << solved.error().reason;
    const auto law = lawOf(solved.value());
    ASSERT_TRUE(law);
    EXPECT_GT(law->noise_dof, 100U);
    const double below = law->probabilityBelow(*solved->chi2_reduced);
    outside += below < 0.05 || below > 0.95 ? 1 : 0;
    warned += std::ranges::count_if(solved->warnings, isNoiseWarning) > 0 ? 1 : 0;
  }
  EXPECT_LE(warned, 5);
  if (kSlower == 1) {
    EXPECT_THAT(outside, runsAreComplete() ? AllOf(Ge(30), Le(95)) : AllOf(Ge(4), Le(30))) << "a tenth is expected";
  }
}

TEST(NoiseCheck, FindsAWrongSigmaOnBothSides) {
  std::mt19937_64 random{10};
  for (int trial = 0; trial < 50; ++trial) {
    const auto noisy = solve(turn(0.001, 0.004, random)).value();
    EXPECT_THAT(noisy.warnings, Contains(AllOf(StartsWith("residuals-exceed-noise: "), HasSubstr("sigma"))));
    EXPECT_NEAR(noisy.estimates[0].sd[0], 0.001 / std::sqrt(12.0) * std::sqrt(*noisy.chi2_reduced), 1e-9);
    const auto still = solve(turn(0.01, 0.001, random)).value();
    EXPECT_THAT(still.warnings, Contains(AllOf(StartsWith("residuals-below-noise: "), HasSubstr("sigma"))));
    EXPECT_NEAR(still.estimates[0].sd[0], 0.01 / std::sqrt(12.0), 1e-9);
  }
}

// Nothing is compared where the sd comes from the same residuals.
TEST(NoiseCheck, HasNothingToSayWithoutAStatedSigma) {
  std::mt19937_64 random{11};
  auto dataset = turn(0.001, 0.01, random);
  dataset.config.erase("sigma_mm");
  const auto solved = solve(dataset).value();
  EXPECT_FALSE(solved.chi2_reduced);
  EXPECT_FALSE(lawOf(solved));
  EXPECT_THAT(solved.warnings, IsEmpty());
}

}  // namespace
}  // namespace probebox::metrology
