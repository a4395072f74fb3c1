// Translations that no rotary axis has: a wrong reading, or a point beside the axis.
#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string_view>
#include <vector>

#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "host-tests/metrology/cases.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Vector3d;
using testing::AllOf;
using testing::HasSubstr;

// Six balls of a table that turns about Z without errors, but at its second angle.
Dataset movedTable(const Vector3d& moved_mm, const Vector3d& stated_point_mm, std::mt19937_64& random) {
  constexpr double kNoise_mm = 1e-3;
  Dataset dataset{.method = "rotary-axis-errors",
                  .config = {{"axis", std::string{"C"}},
                             {"axis_point_mm", std::vector<double>(stated_point_mm.begin(), stated_point_mm.end())},
                             {"axis_direction", std::vector{0.0, 0.0, 1.0}},
                             {"sigma_mm", kNoise_mm}},
                  .tables = {}};
  stateExactMachine(dataset);
  Table& first = addTable(dataset, "first", {"phi_rad", "ball", "x_mm", "y_mm", "z_mm"});
  Table second = Table::withColumns("second", std::vector<std::string_view>{"ball", "x_mm", "y_mm", "z_mm"});
  Table third = Table::withColumns("third", std::vector<std::string_view>{"ball", "x_mm", "y_mm", "z_mm"});
  const auto blurred = [&](const Vector3d& at) {
    return Vector3d{at + Vector3d{gauss(random, kNoise_mm), gauss(random, kNoise_mm), gauss(random, kNoise_mm)}};
  };
  for (const double ball : {1.0, 2.0, 3.0, 4.0, 5.0, 6.0}) {
    const Vector3d at{120 * std::cos(ball), 120 * std::sin(ball), ball < 4 ? 40.0 : 60.0};
    const Vector3d read = blurred(at);
    second.append({ball, read.x(), read.y(), read.z()});
    third.append({ball, at.x(), at.y(), at.z()});
    for (int k = 0; k < 6; ++k) {
      const double phi = kTurn / 6 * k;
      const Vector3d turned = Eigen::AngleAxisd{phi, Vector3d::UnitZ()} * at + (k == 1 ? moved_mm : Vector3d{0, 0, 0});
      const Vector3d seen = blurred(turned);
      first.append({phi, ball, seen.x(), seen.y(), seen.z()});
    }
  }
  dataset.tables.push_back(std::move(second));
  dataset.tables.push_back(std::move(third));
  return dataset;
}

TEST(LargeTranslations, OfOneAngleAreRefused) {
  std::mt19937_64 random{21};
  EXPECT_EQ(refusalOf(movedTable({0, 0, -0.9}, {0, 0, 0}, random)), "");
  for (const Vector3d& moved_mm : {Vector3d{1.1, 0, 0}, Vector3d{0, -1.1, 0}, Vector3d{0, 0, -20}}) {
    const auto solved = solve(movedTable(moved_mm, {0, 0, 0}, random));
    ASSERT_FALSE(solved) << moved_mm;
    EXPECT_EQ(solved.error().name, "errors-too-large");
    EXPECT_THAT(solved.error().reason, AllOf(HasSubstr("60 degrees"), HasSubstr("signs")));
  }
}

TEST(LargeTranslations, OfAPointBesideTheAxisAreRefused) {
  std::mt19937_64 random{22};
  EXPECT_EQ(refusalOf(movedTable({0, 0, 0}, {0.4, 0, 0}, random)), "");
  EXPECT_EQ(refusalOf(movedTable({0, 0, 0}, {0.4, 0, 500}, random)), "") << "anywhere along the axis";
  const auto solved = solve(movedTable({0, 0, 0}, {100, 0, 0}, random));
  ASSERT_FALSE(solved);
  EXPECT_EQ(solved.error().name, "errors-too-large");
  EXPECT_THAT(solved.error().reason, AllOf(HasSubstr("axis_point_mm"), HasSubstr("on the")));
}

}  // namespace
}  // namespace probebox::metrology
