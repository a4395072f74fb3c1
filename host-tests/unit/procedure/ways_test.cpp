#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vector>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "protocol/units/angle.hpp"

// Balls of a plate that stand in the way of the stylus: a run is refused before it begins.
namespace probebox::procedure {
namespace {

// The plate, the table and the stylus that the package ships.
Facts shipped(const std::vector<double>& tilts_deg) {
  Facts facts;
  facts.stylus_ball_diameter_mm = 6;
  facts.ball_plate = BallPlate{.axis_point_mm = {330, 200, -300},
                               .sd_mm = {},
                               .ball_diameter_mm = 12,
                               .b_axis_point_mm = {{330, 200, -260}},
                               .balls_mm = {{30, 0, 140}, {-15, 26, 100}, {-15, -26, 60}}};
  facts.tilting_table =
      BFacts{.axis = {1, 0, 0}, .count = tilts_deg.size(), .sigma_rad = 0, .point_mm = {{330, 200, -260}}};
  for (std::size_t i = 0; i < tilts_deg.size(); ++i) facts.tilting_table->angles_rad[i] = tilts_deg[i] * kDegree;
  return facts;
}

std::string whyNot(const Facts& facts, const ProcedureOptions& options) {
  const auto ready = readied(kRotaryAxisErrors, options, facts, {});
  if (ready) return "";
  EXPECT_EQ(ready.error().because, Obstacle::way) << ready.error().what;
  return ready.error().what;
}

constexpr ProcedureOptions kAboutB{.axis = kAxisB};

TEST(Ways, AreRefusedWhereATiltPutsOneBallAboveAnother) {
  EXPECT_THAT(whyNot(shipped({-60, 0, 60}), kAboutB),
              testing::AllOf(testing::HasSubstr("B 60"), testing::HasSubstr("C 0"), testing::HasSubstr("ball 2"),
                             testing::HasSubstr("[ball_plate]")));
  EXPECT_EQ(whyNot(shipped({-90, 0}), kAboutB), "") << "as shipped";
  EXPECT_EQ(whyNot(shipped({-90, -60, -30, 0, 20}), kAboutB), "");
  EXPECT_EQ(whyNot(shipped({}), {}), "") << "C turns them about a line that is upright";
}

TEST(Ways, AreNotJudgedWithoutTheSizeOfTheBalls) {
  auto facts = shipped({-60, 0, 60});
  facts.ball_plate->ball_diameter_mm.reset();
  EXPECT_EQ(whyNot(facts, kAboutB), "");
}

// A plate that stands free in mount 1 does not in another one that turns it.
TEST(Ways, AreJudgedInEveryMount) {
  auto facts = shipped({-60, 0});
  EXPECT_EQ(whyNot(facts, kAboutB), "");
  constexpr ProcedureOptions kTwoMounts{.axis = kAxisB, .mounts = 2};
  EXPECT_THAT(whyNot(facts, kTwoMounts), testing::AllOf(testing::HasSubstr("mount 2"), testing::HasSubstr("B -60"),
                                                        testing::HasSubstr("mount_turns_deg")))
      << "it may be turned half round";
  facts.ball_plate->mount_turns_rad = {180 * kDegree};
  EXPECT_THAT(whyNot(facts, kTwoMounts), testing::AllOf(testing::HasSubstr("mount 2"), testing::HasSubstr("B -60")));
  facts.ball_plate->mount_turns_rad = {0};
  EXPECT_EQ(whyNot(facts, kTwoMounts), "") << "it was only shifted";
  EXPECT_EQ(whyNot(shipped({}), {.mounts = 3}), "") << "C turns them about a line that is upright";
}

TEST(Ways, HaveRoomForTheStylus) {
  auto facts = shipped({0});
  facts.ball_plate->balls_mm = {{30, 0, 100}, {38, 0, 60}, {-30, 0, 100}};
  EXPECT_THAT(whyNot(facts, {}), testing::AllOf(testing::HasSubstr("ball 1"), testing::HasSubstr("[ball_plate]")))
      << "a ball under another one";
  facts.ball_plate->balls_mm[1] = {60, 0, 60};
  EXPECT_EQ(whyNot(facts, {}), "");
}

}  // namespace
}  // namespace probebox::procedure
