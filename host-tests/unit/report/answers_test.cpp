// What every method owes besides its values, asked of one case of each.
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <gmock/gmock.h>
#include <set>
#include <string>

#include "firmware/metrology/solve.hpp"
#include "tools/case/case_folder.hpp"

namespace probebox {
namespace {

namespace fs = std::filesystem;
using metrology::Estimate;
using metrology::Result;

constexpr std::size_t kLongest = 60;  // numbers of a value that the covariance holds

std::vector<std::pair<std::string, Result>> answers() {
  std::vector<std::pair<std::string, Result>> answers;
  for (const char* root : {PROBEBOX_REPORT_CASES, PROBEBOX_CASES}) {
    for (const auto& entry : fs::recursive_directory_iterator{root}) {
      if (entry.path().filename() != "config.json") continue;
      const auto folder = entry.path().parent_path();
      auto solved = metrology::solve(casefolder::readCase(folder).value());
      EXPECT_TRUE(solved.ok()) << folder << ": " << solved.error().reason;
      if (solved) answers.emplace_back(folder.filename().string(), std::move(solved).value());
    }
  }
  return answers;
}

std::string componentOf(const Estimate& estimate, std::size_t k) {
  if (estimate.shape == metrology::Shape::scalar) return estimate.key;
  if (estimate.shape == metrology::Shape::vector) return estimate.key + "[" + std::to_string(k) + "]";
  return estimate.key + "[" + std::to_string(k / estimate.columns) + "][" + std::to_string(k % estimate.columns) + "]";
}

TEST(Answers, HaveTheCovarianceOfTheirValues) {
  // One value, or values that no linear fit gives.
  const std::set<std::string> without{"delay-contour", "delay-in-out",       "delay-stepped-scan",
                                      "machine-check", "screw-compensation", "selftest"};
  for (const auto& [name, result] : answers()) {
    const bool known = std::ranges::any_of(result.estimates, [](const Estimate& e) { return !e.sd.empty(); });
    if (without.contains(result.method) || !known) continue;
    ASSERT_TRUE(result.covariance) << name;
    const auto& components = result.covariance->components;
    ASSERT_EQ(result.covariance->values.size(), components.size() * components.size()) << name;
    for (const auto& estimate : result.estimates) {
      for (std::size_t k = 0; k < estimate.sd.size() && estimate.sd.size() <= kLongest; ++k) {
        const auto found = std::ranges::find(components, componentOf(estimate, k));
        // The size with another constant; the gain is fitted to the slopes alone.
        if (estimate.key == "static_error_mm" || estimate.key == "gain_matrix") continue;
        ASSERT_NE(found, components.end()) << name << ": " << componentOf(estimate, k);
        const auto at = static_cast<std::size_t>(found - components.begin()) * (components.size() + 1);
        EXPECT_NEAR(std::sqrt(result.covariance->values[at]), estimate.sd[k], 1e-6 * estimate.sd[k])
            << name << ": " << *found;
      }
    }
  }
}

// Columns are found by their names.
TEST(Answers, DoNotDependOnTheOrderOfColumns) {
  for (const auto& entry : fs::recursive_directory_iterator{PROBEBOX_REPORT_CASES}) {
    if (entry.path().filename() != "config.json") continue;
    auto dataset = casefolder::readCase(entry.path().parent_path()).value();
    const auto before = metrology::solve(dataset);
    for (auto& table : dataset.tables) std::ranges::reverse(table.columns);
    const auto after = metrology::solve(dataset);
    ASSERT_TRUE(before.ok() && after.ok()) << dataset.method << ": " << after.error().reason;
    EXPECT_EQ(before->warnings, after->warnings) << dataset.method;
    ASSERT_EQ(before->estimates.size(), after->estimates.size()) << dataset.method;
    for (std::size_t k = 0; k < before->estimates.size(); ++k) {
      EXPECT_EQ(before->estimates[k].values, after->estimates[k].values) << dataset.method;
      EXPECT_EQ(before->estimates[k].sd, after->estimates[k].sd) << dataset.method;
    }
  }
}

TEST(Answers, TellTheirResidualsReadingByReading) {
  const std::set<std::string> without{"screw-compensation", "selftest"};  // nothing is fitted
  for (const auto& [name, result] : answers()) {
    const auto& residuals = result.residuals;
    EXPECT_EQ(residuals.values.empty(), without.contains(result.method)) << name;
    EXPECT_EQ(residuals.names.size(), residuals.values.size()) << name;
    EXPECT_EQ(residuals.at.size(), residuals.values.size()) << name;
  }
}

TEST(Answers, SayHowWellTheirPositionsAreChosen) {
  const std::set<std::string> without{"selftest"};
  for (const auto& [name, result] : answers()) {
    EXPECT_EQ(result.designFigure().has_value(), !without.contains(result.method)) << name;
    EXPECT_EQ(result.design_per.empty(), without.contains(result.method)) << name;
  }
}

}  // namespace
}  // namespace probebox
