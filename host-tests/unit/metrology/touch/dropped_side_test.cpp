// What a delay says of touches that it left out: one of them slipped, or a whole side is another place.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "firmware/metrology/solve.hpp"
#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/touch_simulation.hpp"

namespace probebox::metrology {
namespace {

using testing::HasSubstr;

std::vector<std::string> ofDropped(const Result& result) {
  std::vector<std::string> all;
  for (const auto& warning : result.warnings)
    if (warning.starts_with("dropped: ")) all.push_back(warning);
  return all;
}

// Dirt of 6 um on one side of the sphere, which is touched at each of five speeds. Centre and radius leave one of five
// sides over: which one is wrong nobody can tell.
TEST(DroppedTouches, OfOneSideAreOneWarningAboutItsForm) {
  std::mt19937_64 random{5};
  simulation::Scene scene;
  scene.errors.form_mm = [](const Eigen::Vector3d& normal) { return normal.x() < -0.9 ? 0.006 : 0.0; };
  const auto solved = solve(simulation::measure(scene, random));
  ASSERT_TRUE(solved) << solved.error().reason;
  ASSERT_EQ(solved->dropped.size(), scene.speeds_mm_s.size());
  const auto warnings = ofDropped(*solved);
  ASSERT_EQ(warnings.size(), 1);
  for (const auto& dropped : solved->dropped) EXPECT_THAT(warnings.front(), HasSubstr(dropped.name));
  EXPECT_THAT(warnings.front(), HasSubstr("machine-check"));
  const auto* tau = solved->find("tau_s");
  EXPECT_LT(std::abs(tau->value() - scene.tau()), 4 * tau->sd.front());
}

// The sensor's range ends early on one side: that is no form.
TEST(DroppedTouches, OfOneSideKeepAnotherReason) {
  std::mt19937_64 random{5};
  const simulation::Scene scene;
  auto dataset = simulation::measure(scene, random);
  const auto& normals = columnNamed(dataset, "touches", "nx");
  const auto& touch = columnNamed(dataset, "probe", "touch");
  const auto is_left = [&](std::size_t row) { return normals[static_cast<std::size_t>(touch[row])] < -0.9; };
  for (const auto* channel : {"a", "b", "c"}) {
    auto& values = columnNamed(dataset, "probe", channel);
    double deepest = 0;
    for (std::size_t row = 0; row < values.size(); ++row)
      if (is_left(row)) deepest = std::max(deepest, std::abs(values[row]));
    for (std::size_t row = 0; row < values.size(); ++row)
      if (is_left(row)) values[row] = std::clamp(values[row], -0.6 * deepest, 0.6 * deepest);
  }
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved) << solved.error().reason;
  ASSERT_EQ(solved->dropped.size(), scene.speeds_mm_s.size());
  for (const auto& dropped : solved->dropped) EXPECT_THAT(dropped.reason, testing::Not(HasSubstr("disagrees")));
  const auto warnings = ofDropped(*solved);
  ASSERT_EQ(warnings.size(), 1);
  EXPECT_THAT(warnings.front(), testing::Not(HasSubstr("machine-check")));
}

TEST(DroppedTouches, ThatSlippedAreToBeTouchedAgain) {
  std::mt19937_64 random{6};
  const simulation::Scene scene;
  auto dataset = simulation::measure(scene, random);
  const auto last = columnNamed(dataset, "machine", "touch").back();
  const auto touch = columnNamed(dataset, "machine", "touch");
  auto& y = columnNamed(dataset, "machine", "y_mm");
  for (std::size_t row = 0; row < touch.size(); ++row) y[row] += touch[row] == last - 1 ? 0.02 : 0;
  const auto solved = solve(dataset);
  ASSERT_TRUE(solved) << solved.error().reason;
  ASSERT_EQ(solved->dropped.size(), 1);
  const auto warnings = ofDropped(*solved);
  ASSERT_EQ(warnings.size(), 1);
  EXPECT_THAT(warnings.front(),
              testing::AllOf(HasSubstr(solved->dropped.front().name), testing::Not(HasSubstr("machine-check"))));
}

}  // namespace
}  // namespace probebox::metrology
