// Values of results as the box serves them.
#include "firmware/app/results/result_values.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace probebox::app {
namespace {

using metrology::Estimate;
using testing::ElementsAre;

// A periodic check answers X and Y by themselves.
TEST(StylusOffset, OfACheckHasItsUncertaintyBesideItsSd) {
  metrology::Result check;
  check.method = "periodic-check";
  check.also = {Estimate::scalar("stylus_offset_x_mm", 0.02, 1e-4), Estimate::scalar("stylus_offset_y_mm", 0.03, 2e-4)};
  EXPECT_THAT(stylusOffsetOf(check)->uncertainty, testing::IsEmpty());
  check.also[0].uncertainty = {3e-3};
  check.also[1].uncertainty = {4e-3};
  const auto offset = stylusOffsetOf(check);
  EXPECT_THAT(offset->values, ElementsAre(0.02, 0.03));
  EXPECT_THAT(offset->sd, ElementsAre(1e-4, 2e-4));
  EXPECT_THAT(offset->uncertainty, ElementsAre(3e-3, 4e-3));
}

// The centreline from the spindle axis is as uncertain as its parts, and its budget says by how much each.
TEST(StylusOffset, GoesIntoACentrelineWithItsUncertainty) {
  metrology::Result from_tip;
  from_tip.estimates = {Estimate::vector("centre_mm", {1, 2}, {1e-3, 1e-3})};
  from_tip.estimates.front().uncertainty = {1e-3, 1e-3};
  from_tip.budget = {{.name = "readings", .type_b = false, .sd = {1e-3, 1e-3}}};
  auto offset = Estimate::vector("stylus_offset_mm", {0.02, 0.03}, {1e-4, 2e-4});
  offset.uncertainty = {3e-3, 4e-3};
  const auto whole = relativeToSpindle(from_tip, offset, 7);
  ASSERT_TRUE(whole);
  EXPECT_NEAR(whole->estimates.front().uncertainty[0], std::hypot(1e-3, 3e-3), 1e-12);
  ASSERT_EQ(whole->budget.size(), 2U);
  EXPECT_THAT(whole->budget[1].sd, ElementsAre(3e-3, 4e-3));
}

}  // namespace
}  // namespace probebox::app
