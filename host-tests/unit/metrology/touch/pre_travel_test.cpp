#include "firmware/metrology/touch/pre_travel.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

#include "firmware/metrology/touch/switched_touch.hpp"
#include "host-tests/metrology/moments.hpp"
#include "host-tests/metrology/switched_probe.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;
using testing::HasSubstr;

TEST(PreTravel, FindsMeanLobesAndTheWayAlongTheStylus) {
  const Vector3d centre{100, -50, -200};
  const Probe probe;
  const auto result = solvePreTravel(touched(probe, directions(true), centre));
  ASSERT_TRUE(result) << result.error().reason;
  const auto& found = result->find("pre_travel_mm")->values;
  ASSERT_EQ(found.size(), 4U);
  EXPECT_NEAR(found[0], probe.mean_mm, 1e-6);
  EXPECT_NEAR(found[1], probe.cosine_mm, 1e-6);
  EXPECT_NEAR(found[2], probe.sine_mm, 1e-6);
  EXPECT_NEAR(found[3], probe.along_mm, 1e-6);
  for (Eigen::Index axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(result->find("centre_mm")->values[static_cast<std::size_t>(axis)], centre[axis], 1e-6);
  EXPECT_NEAR(result->find("switch_late_s")->value(), probe.late_s, 1e-9);
}

// Without touches from below the way along the stylus is in the height of the centre, and the answer says so.
TEST(PreTravel, NamesWhatTouchesFromAboveLeaveOpen) {
  const Probe probe;
  const auto result = solvePreTravel(touched(probe, directions(false), Vector3d::Zero()));
  ASSERT_TRUE(result) << result.error().reason;
  const auto& found = result->find("pre_travel_mm")->values;
  ASSERT_EQ(found.size(), 3U);
  EXPECT_NEAR(found[0], probe.mean_mm, 5e-6);
  EXPECT_NEAR(result->find("centre_mm")->values[2], -probe.along_mm, 5e-6);
  EXPECT_THAT(result->unobservable, testing::Contains(HasSubstr("along")));
}

// An error of the sphere's size is not taken for a way along the stylus, which displaces centres.
TEST(PreTravel, TellsAnErrorOfTheSphereFromItsParts) {
  const Probe probe;
  auto dataset = touched(probe, directions(true), Vector3d::Zero());
  const double error_mm = 0.003;
  dataset.config["effective_diameter_mm"] = 2 * (Probe::kRadius_mm - error_mm);
  const auto result = solvePreTravel(dataset);
  ASSERT_TRUE(result) << result.error().reason;
  EXPECT_NEAR(result->find("radius_error_mm")->value(), error_mm, 1e-6);
  EXPECT_NEAR(result->find("pre_travel_mm")->values[0], probe.mean_mm, 2e-6);
  EXPECT_NEAR(result->find("pre_travel_mm")->values[3], probe.along_mm, 2e-6);
  EXPECT_THAT(result->unobservable, testing::Not(testing::Contains(HasSubstr("error of effective_diameter_mm"))));

  // Three heights leave it open, and the answer says so.
  auto few = directions(true);
  std::erase_if(few, [](const Vector3d& n) { return n.z() > 0.1 && n.z() < 0.9; });
  const auto open = solvePreTravel(touched(probe, few, Vector3d::Zero()));
  ASSERT_TRUE(open) << open.error().reason;
  EXPECT_EQ(open->find("radius_error_mm"), nullptr);
  EXPECT_THAT(open->unobservable, testing::Contains(HasSubstr("error of effective_diameter_mm")));
}

TEST(PreTravel, HasTheUncertaintyThatItStates) {
  constexpr int kRuns = 200;
  Moments errors;
  Probe probe;
  probe.scatter_mm = 5e-4;
  for (int run = 0; run < kRuns; ++run) {
    auto dataset = touched(probe, directions(true), Vector3d::Zero(), static_cast<std::uint64_t>(run) + 1);
    dataset.config["sigma_mm"] = probe.scatter_mm;
    const auto result = solvePreTravel(dataset);
    ASSERT_TRUE(result) << result.error().reason;
    const auto& found = *result->find("pre_travel_mm");
    const std::array<double, 4> truth{probe.mean_mm, probe.cosine_mm, probe.sine_mm, probe.along_mm};
    for (std::size_t k = 0; k < truth.size(); ++k) errors.add(found.values[k] - truth[k], found.sd[k]);
  }
  expectHonest(errors);
}

TEST(PreTravel, RefusesDirectionsThatLeaveALobeOpen) {
  auto sides = directions(false);
  sides.erase(sides.begin() + 12, sides.begin() + 18);  // those at 45 degrees
  sides.erase(sides.begin() + 3, sides.begin() + 5);
  const auto result = solvePreTravel(touched({}, sides, Vector3d::Zero()));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().name, "few-directions");
  EXPECT_THAT(result.error().reason, HasSubstr("90 degrees"));
}

// Every touch again under a number of its own.
TEST(PreTravel, RefusesTouchesThatAreCopies) {
  auto dataset = touched({.scatter_mm = 5e-4}, directions(true), Vector3d::Zero());
  ASSERT_TRUE(solvePreTravel(dataset));
  for (auto& table : dataset.tables) {
    for (auto& column : table.columns) {
      const auto once = column.values;
      for (const double value : once) column.values.push_back(column.name == "touch" ? value + 100 : value);
    }
  }
  const auto result = solvePreTravel(dataset);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().name, "duplicated-reading");
  EXPECT_THAT(result.error().reason, testing::AllOf(HasSubstr("points 1"), HasSubstr("and 26")));
}

TEST(PreTravel, RefusesASphereThatCannotHaveThatSize) {
  auto dataset = touched({.scatter_mm = 1e-4}, directions(true), Vector3d::Zero());
  dataset.config["effective_diameter_mm"] = 2 * Probe::kRadius_mm - 0.1;
  const auto result = solvePreTravel(dataset);
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().name, "pre-travel-negative");
  EXPECT_THAT(result.error().reason, HasSubstr("effective_diameter_mm"));
}

TEST(PreTravel, RefusesANegativeWayAlongTheStylusAlone) {
  const auto result =
      solvePreTravel(touched({.along_mm = -0.004, .scatter_mm = 1e-4}, directions(true), Vector3d::Zero()));
  ASSERT_FALSE(result);
  EXPECT_EQ(result.error().name, "pre-travel-negative");
  EXPECT_THAT(result.error().reason, HasSubstr("along"));
}

}  // namespace
}  // namespace probebox::metrology
