#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <string>

#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/prompts.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"

// Steps at which the shank of the stylus touches a ball in the place of a second tool: what is asked for, and what it
// needs.
namespace probebox::procedure {
namespace {

using testing::HasSubstr;

Facts factsWithShank() {
  Facts facts;
  facts.stylus_ball_diameter_mm = 6;
  facts.sphere_diameter_mm = 25;
  facts.probe_shank = ProbeShank{.tool = 3, .tip_length_mm = 150, .radius_mm = 5, .height_mm = 50};
  facts.swivel_head = HeadFacts{.b = {.axis = {0, 1, 0}, .count = 3, .angles_rad = {0, 0.8, -1.5}, .sigma_rad = 0},
                                .pivot_mm = {},
                                .ball_mm = {},
                                .sd_ball_mm = {}};
  return facts;
}

std::unique_ptr<Plan> planned(const LiveMethod& method) {
  auto plan = std::make_unique<Plan>();
  const auto options = described(method, {}, factsWithShank(), ReadBy::shank).value();
  EXPECT_FALSE(validate(method, options, 1));
  fill(*plan, method, options);
  return plan;
}

TEST(ShankPlan, ReadsTheBallWithTheTipAndThenTouchesItWithTheShankOfTheSameTool) {
  const auto plan = planned(kAAxisAlignment);
  ASSERT_EQ(plan->step_count, 4U * 5U + 4U * 4U + 5U);
  EXPECT_EQ(plan->steps[36].touch.shank_height_mm, 0) << "the tip closes the run";
  for (std::size_t k = 0; k < 36; ++k) {
    const auto& touch = plan->steps[k].touch;
    EXPECT_EQ(touch.tool, 3U);
    EXPECT_EQ(touch.shank_height_mm, k < 20 ? 0 : 50) << k;
    EXPECT_EQ(touch.reading, k < 20 ? k / 5 : 4 + (k - 20) / 4) << k;
    EXPECT_TRUE(k < 20 || touch.outward_normal[2] == 0) << "along the tool a shank tells nothing";
  }
  EXPECT_THAT(promptFor(*plan, 19), testing::Not(HasSubstr("shank")));
  EXPECT_THAT(promptFor(*plan, 20), testing::AllOf(HasSubstr("touch 21"), HasSubstr("tool 3"), HasSubstr("+X side"),
                                                   HasSubstr("ball 1"), HasSubstr("50 mm"), HasSubstr("0.5 mm")));
}

// The stem holds a ball from below; what hangs on a shank that touches a side which looks down would cross it.
TEST(ShankPlan, LeavesSidesThatLookDownToTheStem) {
  const auto plan = planned(kSwivelError);
  std::array<int, 3> sides{};
  for (std::size_t k = 0; k < plan->step_count; ++k) {
    const auto& touch = plan->steps[k].touch;
    if (touch.shank_height_mm == 0) continue;
    const double b_rad = touch.rotary_angles_rad[1];
    ++sides[b_rad == 0 ? 0 : b_rad > 0 ? 1 : 2];
    const auto& n = touch.outward_normal;
    EXPECT_GE(n[2], 0) << k;
    // The tool swivels about Y.
    EXPECT_NEAR(n[0] * std::sin(b_rad) + n[2] * std::cos(b_rad), 0, 1e-12) << "across the tool";
  }
  EXPECT_EQ(sides, (std::array{2 * 4, 2 * 3, 2 * 3})) << "with A at 0 and at 180 degrees";
}

TEST(ShankPlan, NeedsAShankThatIsDescribedAndNoSecondTool) {
  for (const auto* method : {&kAAxisAlignment, &kSwivelError}) {
    Facts facts = factsWithShank();
    EXPECT_FALSE(whyNoShank(*method, facts));
    EXPECT_FALSE(whyUnready(*method, facts, true, ReadBy::shank));
    EXPECT_THAT(whyUnready(*method, facts, false, ReadBy::shank)->what, HasSubstr("calibrate"));
    EXPECT_THAT(whyUnready(*method, facts, true)->what, HasSubstr("[probe_tools]"));
    facts.probe_shank.reset();
    EXPECT_THAT(whyNoShank(*method, facts)->what, testing::AllOf(HasSubstr("[probe_shank]"), HasSubstr("radius_mm")));
  }
  EXPECT_THAT(whyNoShank(kHeadPivot, factsWithShank())->what, HasSubstr("head-pivot"));
  const auto options = described(kAAxisAlignment, {}, factsWithShank(), ReadBy::shank).value();
  EXPECT_THAT(validate(kHeadPivot, {.shank_height_mm = 50}, 1)->what, HasSubstr("shank"));
  EXPECT_EQ(options.tool_count, 2);
  EXPECT_EQ(described(kAAxisAlignment, {}, factsWithShank()).value().shank_height_mm, 0);
  Facts no_head = factsWithShank();
  no_head.swivel_head.reset();
  EXPECT_THAT(whyUnready(kSwivelError, no_head, true, ReadBy::shank)->what, HasSubstr("[swivel_head]"));
}

TEST(ShankPlan, IsRefusedWhereTheStylusBallWouldComeToTheBallAsWell) {
  Facts facts = factsWithShank();
  facts.probe_shank->height_mm = 15.4;
  EXPECT_THAT(whyNoShank(kSwivelError, facts)->what,
              testing::AllOf(HasSubstr("[probe_shank]"), HasSubstr("height_mm"), HasSubstr("15.5")));
  EXPECT_FALSE(whyNoShank(kAAxisAlignment, facts)) << "nobody says how large the ball of the part is";
  facts.checked_ball = CheckedBall{.diameter_mm = 26};
  EXPECT_THAT(whyNoShank(kAAxisAlignment, facts)->what, HasSubstr("above 16"));
}

}  // namespace
}  // namespace probebox::procedure
