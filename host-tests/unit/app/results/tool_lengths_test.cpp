#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "accepting.hpp"

// Lengths of tools in force, of which the core holds so many.
namespace probebox::app {
namespace {

using metrology::Estimate;
using testing::HasSubstr;

class ToolLengths : public Accepting {};

TEST_F(ToolLengths, AreRefusedWhereTheCoreHoldsNoMore) {
  const auto lengthOf = [](double length_mm) {
    auto result = resultOf("tool-assembly", {Estimate::scalar("assembled_length_mm", length_mm - 60, 1e-3)});
    result.also = {Estimate::scalar("gauge_length_mm", length_mm, 1e-3)};
    return result;
  };
  const auto subject = [](std::size_t tool) { return "assembly-" + std::to_string(tool); };
  for (std::size_t tool = 1; tool <= corrections::kMostMeasuredTools; ++tool) acceptedAs(subject(tool), lengthOf(120));
  const auto one_more = propose(subject(500), lengthOf(90));
  const auto refused = results_.accept(one_more, "Ada");
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().what, HasSubstr("99 tools"));
  acceptedAs(subject(7), lengthOf(120.001));  // of a tool that has its place
  const auto none = results_.rollBack(inForce(subject(1))->id, "Ada");
  ASSERT_TRUE(none) << none.error().what;
  EXPECT_TRUE(results_.accept(one_more, "Ada"));
}

}  // namespace
}  // namespace probebox::app
