#include <algorithm>
#include <gtest/gtest.h>
#include <string>
#include <utility>
#include <vector>

#include "scenario.hpp"

// Every touch method for the delay, run on the emulated machine: its controller drives where the box prompts.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using procedure::Method;

TEST(LiveInOut, GoesInAndAtOnceBackOut) {
  Scenario scenario{usualWorld(), 2};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  scenario.calibrate(Method::delay_in_out);
  EXPECT_EQ(scenario.machine().stylus().contactCount(), 1U);
  const auto* probe = scenario.dataset().table("probe");
  ASSERT_NE(probe, nullptr);
  const auto& depth = *probe->column("a");
  const double deepest = *std::ranges::max_element(depth);
  EXPECT_NEAR(deepest, 0.5, 0.2);
  std::size_t touching = 0, flat = 0;
  for (const double a : depth) {
    touching += std::abs(a) > 0.05 * deepest ? 1U : 0U;
    flat += std::abs(a) > 0.95 * deepest ? 1U : 0U;
  }
  EXPECT_GT(touching, 30U);
  EXPECT_LT(static_cast<double>(flat), 0.2 * static_cast<double>(touching)) << "a dwell would hide the apex";
}

TEST(LiveCases, HaveTheTablesAndKeysOfTheirMethods) {
  const std::vector<std::pair<Method, std::vector<std::string>>> cases{
      {Method::delay_known_sphere, {"effective_diameter_mm", "feature"}},
      {Method::delay_plates, {"feature", "gap_mm", "stylus_ball_diameter_mm"}},
      {Method::delay_non_normal, {"effective_diameter_mm"}},
      {Method::delay_in_out, {}},
  };
  for (const auto& [method, keys] : cases) {
    Scenario scenario{usualWorld(), 2};
    scenario.recorder().keeps_bytes = false;
    scenario.run(2s);
    scenario.calibrate(method);
    const auto& dataset = scenario.dataset();
    EXPECT_EQ(dataset.method, procedure::nameOf(method));
    std::vector<std::string> found;
    for (const auto& [key, value] : dataset.config) found.push_back(key);
    EXPECT_EQ(found, keys) << dataset.method;
    ASSERT_EQ(dataset.tables.size(), 3U);
    EXPECT_EQ(dataset.tables[2].rows(), scenario.state().procedure.steps);
  }
}

}  // namespace
}  // namespace probebox::scenario
