#include "firmware/app/results/served_results.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace probebox::app {
namespace {

using testing::ElementsAre;

// What the registers say of a value is what it may be off, with what is known of its inputs.
TEST(ServedResults, HaveTheirCombinedUncertainty) {
  metrology::Result result;
  result.method = "tool-setter";
  result.estimates = {metrology::Estimate::vector("tool_offset_mm", {1, 2, 150}, {4e-4, 4e-4, 4e-4}),
                      metrology::Estimate::scalar("tool_radius_mm", 5, 3e-4)};
  result.estimates.front().uncertainty = {4e-4, 4e-4, 2e-3};
  store::Record record{};
  record.binding.subject = "tool-4";
  record.content = result;
  const auto served = servedOf(record, false);
  ASSERT_EQ(served.values.size(), 2U);
  EXPECT_THAT(served.values[0].sd, ElementsAre(4e-4, 4e-4, 2e-3));
  EXPECT_THAT(served.values[1].sd, ElementsAre(3e-4)) << "nothing else is known of it";
}

}  // namespace
}  // namespace probebox::app
