#include <array>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

#include "firmware/app/results/result_events.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "measured.hpp"
#include "protocol/units/angle.hpp"
#include "pulls.hpp"
#include "swivel_truth.hpp"

// Methods that swivel the head or change the tool that carries the probe, run on the emulated machine.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using procedure::LiveMethod;
using testing::ElementsAre;

const std::uint64_t kSwivelSeeds = runs(20);

TEST(LiveSwivelError, SaysWhatTheControlIsOffAndByHowMuchThatMayBeWrong) {
  Pulls across, along;
  for (std::uint64_t seed = 1; seed <= kSwivelSeeds; ++seed) {
    const auto config = swivelWorld(seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kSwivelError);
    ASSERT_TRUE(result);
    const auto* error = result->find("error_at_queries_mm");
    ASSERT_NE(error, nullptr);
    const auto& queries = *scenario.dataset().table("queries");
    EXPECT_EQ(queries.rows(), 4U) << "at B = 0 there is no error";
    for (std::size_t row = 0; row < queries.rows(); ++row) {
      const double b_deg = queries.column("B_deg")->at(row), length_mm = queries.column("L_mm")->at(row);
      const auto truth = errorOf(scenario.machine(), b_deg * kDegree, length_mm == 150 ? 1 : 2, length_mm);
      for (std::size_t i = 0; i < 3; ++i) {
        const double value = error->values[3 * row + i], sd = error->sd[3 * row + i];
        EXPECT_LT(sd, 1e-3);
        (i == 1 ? along : across).add(value, truth[i], sd);
      }
    }
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
    EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "swivel-b");
  }
  across.expectHonest(Pulls::kCautious);
  along.expectHonest(Pulls::kCautious);  // where no stop of the head matters
}

TEST(LiveSwivelError, ReadsTheSphereAtEveryAngleWithEveryTool) {
  Scenario scenario{usualWorld(), 2};
  ASSERT_TRUE(measured(scenario, procedure::kSwivelError));
  const auto& readings = *scenario.dataset().table("readings");
  EXPECT_THAT(*readings.column("B_deg"), ElementsAre(0, 45, 90, 0, 45, 90, 0));
  EXPECT_THAT(*readings.column("L_mm"), ElementsAre(150, 150, 150, 200, 200, 200, 150));
  // Two readings at each: five sides of the sphere, but at 90 degrees one of them is where its stem stands.
  EXPECT_EQ(scenario.dataset().table("touches")->rows(), 2U * 2U * (5 + 5 + 4) + 2U * 5);
  scenario.run(30s);
  EXPECT_EQ(scenario.machine().commandedPose(), (world::Pose{.a_rad = std::numbers::pi})) << "the head is level again";
  EXPECT_EQ(scenario.machine().tool(), 1U);
  EXPECT_EQ(scenario.controller().activity(), world::Activity::asking);

  const auto solved = scenario.calibrate(procedure::kDelayKnownSphere);
  ASSERT_TRUE(solved && solved->ok());
  EXPECT_NEAR(solved->value().find("centre_mm")->values[2], -150, 0.01);
}

TEST(LiveHeadPivot, FindsTheAxisOfTheHeadWithTheUncertaintyThatItStates) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= kSwivelSeeds; ++seed) {
    const auto config = swivelWorld(seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kHeadPivot);
    ASSERT_TRUE(result);
    // Positions are those of the first tool's stylus ball, 150 mm below the reference.
    const auto& pivot_mm = config.swivel_head->pivot_mm;
    add(pulls, *result, "pivot_xz_mm", {pivot_mm[0], pivot_mm[2] + 150}, 1e-3);
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  pulls.expectHonest();
}

TEST(LiveSpindleAlignment, FindsTheLeanOfTheProbesSpindleWithTheUncertaintyThatItStates) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= kSwivelSeeds; ++seed) {
    const auto config = swivelWorld(seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kAAxisAlignment);
    ASSERT_TRUE(result);
    const auto& direction = config.probe_spindle.direction;
    add(pulls, *result, "A_tilt_rad", {direction[0], direction[1]}, 2e-5);
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  pulls.expectHonest();
}

TEST(LiveSpindleAlignmentByShank, FindsTheLeanOfTheProbesSpindleWithTheUncertaintyThatItStates) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= kSwivelSeeds; ++seed) {
    const auto config = shankWorld(seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kAAxisAlignment, byShank(procedure::kAAxisAlignment));
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->warnings.empty()) << result->warnings.front();
    const auto& direction = config.probe_spindle.direction;
    add(pulls, *result, "A_tilt_rad", {direction[0], direction[1]}, 2e-5);
    EXPECT_EQ(scenario.machine().tool(), 1U) << "one tool has both";
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  pulls.expectHonest();
}

TEST(LiveSpindleAlignmentByShank, TouchesFromOppositeSidesWithTheSpindleTurnedBetween) {
  Scenario scenario{shankWorld(2), 2};
  ASSERT_TRUE(measured(scenario, procedure::kAAxisAlignment, byShank(procedure::kAAxisAlignment)));
  const auto& shank = *scenario.dataset().table("shank");
  ASSERT_EQ(shank.rows(), 16U) << "four sides in each of four poses";
  for (const double half_turns : {0.0, 1.0}) {
    int from_plus_x = 0, from_minus_x = 0;
    for (std::size_t row = 0; row < shank.rows(); ++row) {
      EXPECT_EQ(shank.column("tip_length_mm")->at(row), 100);
      if (std::abs(shank.column("A_rad")->at(row) - half_turns * std::numbers::pi) > 1e-6) continue;
      from_plus_x += shank.column("ux")->at(row) == 1;
      from_minus_x += shank.column("ux")->at(row) == -1;
    }
    EXPECT_EQ(from_plus_x, 2);
    EXPECT_EQ(from_minus_x, 2);
  }
  EXPECT_THAT(*scenario.dataset().table("readings")->column("tip_length_mm"), testing::Each(150));
}

TEST(LiveSwivelErrorByShank, SaysWhatTheControlIsOffAndByHowMuchThatMayBeWrong) {
  Pulls across;
  for (std::uint64_t seed = 1; seed <= runs(40); ++seed) {
    const auto config = shankWorld(seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kSwivelError, byShank(procedure::kSwivelError));
    ASSERT_TRUE(result);
    EXPECT_TRUE(result->warnings.empty()) << result->warnings.front();
    EXPECT_NEAR(result->find("shank_effective_radius_mm")->values[0], 12.5 + config.probe_spindle.shank->radius_mm,
                2e-3);
    const auto* error = result->find("error_at_queries_mm");
    const auto& queries = *scenario.dataset().table("queries");
    ASSERT_EQ(queries.rows(), 4U) << "both lengths at 45 and 90 degrees";
    for (std::size_t row = 0; row < queries.rows(); ++row) {
      const double b_rad = queries.column("B_deg")->at(row) * kDegree, length_mm = queries.column("L_mm")->at(row);
      const auto truth = errorOfShank(config, b_rad, length_mm);
      for (std::size_t i = 0; i < 3; ++i) {
        const double value = error->values[3 * row + i], sd = error->sd[3 * row + i];
        EXPECT_LT(sd, 1e-3);
        if (i == 1) {
          // A touch with the shank has one sd, with what a stop of the head makes of it: along the axis that is too
          // much.
          EXPECT_LT(std::abs(value - truth[i]), 4 * sd);
        } else {
          across.add(value, truth[i], sd);
        }
      }
    }
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
    EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "swivel-b");
  }
  across.expectHonest();
}

// Where the head is swivelled the side that looks down is the stem's, and the shank would cross it.
TEST(LiveSwivelError, RestsOnTheAssembliesThatHaveTheLengthsOfItsTools) {
  Scenario scenario{usualWorld(), 6};
  scenario.facts.takeLength(2, 200.02, 43, 0.004);
  ASSERT_TRUE(measured(scenario, procedure::kSwivelError));
  const auto& dataset = scenario.dataset();
  EXPECT_THAT(*dataset.table("readings")->column("L_mm"), ElementsAre(150, 150, 150, 200.02, 200.02, 200.02, 150));
  EXPECT_FALSE(dataset.config.contains("length_1_result")) << "machine.toml has that length";
  EXPECT_EQ(std::get<double>(dataset.config.at("length_2_result")), 43);
  EXPECT_FALSE(dataset.config.contains("sd_length_1_mm")) << "not stated";
  EXPECT_EQ(std::get<double>(dataset.config.at("sd_length_2_mm")), 0.004);

  scenario.facts.takeLength(1, 150.02, 44, 0.003);
  const auto solved = scenario.calibrate(procedure::kSwivelError, byShank(procedure::kSwivelError));
  ASSERT_TRUE(solved && solved->ok());
  EXPECT_THAT(*scenario.dataset().table("shank")->column("L_mm"), testing::Each(testing::DoubleNear(100.02, 1e-9)));
  EXPECT_EQ(std::get<double>(scenario.dataset().config.at("length_1_result")), 44);
  EXPECT_FALSE(scenario.dataset().config.contains("length_2_result")) << "of a tool that was not read";
  EXPECT_EQ(std::get<double>(scenario.dataset().config.at("sd_length_1_mm")), 0.003);
  EXPECT_FALSE(scenario.dataset().config.contains("sd_length_2_mm"));
}

TEST(LiveSwivelErrorByShank, LeavesTheSideOfTheStemAlone) {
  Scenario scenario{usualWorld(), 3};
  ASSERT_TRUE(measured(scenario, procedure::kSwivelError, byShank(procedure::kSwivelError)));
  const auto& shank = *scenario.dataset().table("shank");
  EXPECT_THAT(*shank.column("B_deg"), ElementsAre(0, 0, 0, 0, 45, 45, 45, 90, 90, 90));
  for (const double down : *shank.column("uz")) EXPECT_GE(down, 0);
}

// The radii cancel between opposite sides, so that a shank of another radius than that which is described shows.
TEST(LiveShank, IsRefusedWhereAnotherRadiusTouches) {
  auto config = usualWorld();
  config.probe_spindle.shank->radius_mm = 4.7;
  Scenario scenario{config, 5};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  scenario.activateDelay(scenario.truth().tau_s);
  const auto solved = scenario.calibrate(procedure::kAAxisAlignment, byShank(procedure::kAAxisAlignment));
  ASSERT_TRUE(solved);
  ASSERT_FALSE(solved->ok());
  EXPECT_EQ(solved->error().name, "shank-radius-wrong");
  EXPECT_EQ(scenario.dataset().table("touches")->rows(), 41U) << "the touches are there nevertheless";
}

// All axes alike late: that makes the radii larger, of tip and shank alike, and moves nothing.
TEST(LiveShank, IsNotMovedByAWrongDelay) {
  Scenario scenario{shankWorld(6), 6};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  auto tau_s = scenario.truth().tau_s;
  for (double& tau : tau_s) tau += 1e-3;
  scenario.activateDelay(tau_s);
  const auto solved = scenario.calibrate(procedure::kSwivelError, byShank(procedure::kSwivelError));
  ASSERT_TRUE(solved && solved->ok());
  EXPECT_NEAR(solved->value().find("shank_effective_radius_mm")->values[0],
              12.5 + shankWorld(6).probe_spindle.shank->radius_mm + 15 * 1e-3, 2e-3);
  const auto* direction = solved->value().find("tool_direction_rad");
  EXPECT_LT(std::abs(direction->values[1] + shankWorld(6).probe_spindle.direction[0]), 4 * direction->sd[1]);
}

TEST(LiveHeadMethods, AreRefusedWithoutADelay) {
  for (const auto* method : {&procedure::kSwivelError, &procedure::kHeadPivot, &procedure::kAAxisAlignment}) {
    Scenario scenario{usualWorld(), 4};
    scenario.recorder().keeps_bytes = false;
    scenario.run(2s);
    const auto solved = scenario.calibrate(*method);
    ASSERT_TRUE(solved);
    ASSERT_FALSE(solved->ok());
    EXPECT_EQ(solved->error().name, "no-delay");
  }
}

}  // namespace
}  // namespace probebox::scenario
