#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "drivers/world/random.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "measured.hpp"
#include "protocol/units/angle.hpp"
#include "pulls.hpp"
#include "swivel_truth.hpp"
#include "touch_trigger_probe.hpp"

// swivel-error with a touch-trigger probe, whose pre-travel is another one in each tool.
namespace probebox::scenario {
namespace {

using testing::HasSubstr;

const std::uint64_t kSwitchSwivelSeeds = runs(20);

world::Config withSwitch(world::Config config, std::uint64_t seed) {
  world::Random random{seed, 94};
  config.touch_trigger = someSwitch(random);
  return config;
}

// Errors in the plane of the swivel. Those of one run share its pre-travels and its B, so one run is one draw of
// several: their mean square still is 1.
void addErrors(Pulls& across, Pulls& along, const Scenario& scenario, const metrology::Result& result,
               const std::function<world::Vector3(double, double)>& truthOf) {
  const auto* error = result.find("error_at_queries_mm");
  const auto& queries = *scenario.dataset().table("queries");
  ASSERT_EQ(queries.rows(), 4U);
  for (std::size_t row = 0; row < queries.rows(); ++row) {
    const double b_rad = queries.column("B_deg")->at(row) * kDegree, length_mm = queries.column("L_mm")->at(row);
    const auto truth = truthOf(b_rad, length_mm);
    for (std::size_t i = 0; i < 3; ++i) {
      const double value = error->values[3 * row + i], sd = error->uncertainty[3 * row + i];
      EXPECT_LT(sd, 2e-3);
      (i == 1 ? along : across).add(value, truth[i], sd);
    }
  }
}

TEST(TriggerProbe, FindsTheErrorOfTheHeadAsWellAsItSays) {
  Pulls across, along;
  for (std::uint64_t seed = 1; seed <= kSwitchSwivelSeeds; ++seed) {
    const auto config = withSwitch(swivelWorld(500 + seed), seed);
    Scenario scenario{config, seed};
    for (const std::uint32_t tool : {1U, 2U}) ASSERT_TRUE(qualified(scenario, tool));
    const auto result = runWithSwitch(scenario, procedure::kSwivelError);
    ASSERT_TRUE(result);
    addErrors(across, along, scenario, *result, [&](double b_rad, double length_mm) {
      return errorOf(scenario.machine(), b_rad, length_mm == 150 ? 1 : 2, length_mm);
    });
    EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "swivel-b");
    EXPECT_EQ(std::get<double>(scenario.dataset().config.at("pre_travel_1_result")), 43);
    EXPECT_EQ(std::get<double>(scenario.dataset().config.at("pre_travel_2_result")), 44);
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  across.expectHonest();
  along.expectHonest();
}

// Of the shank nothing has to be known: its pre-travel is the same on all sides but for the lobes, so it is in the
// radii, and the lobes cancel over half a turn of A.
TEST(TriggerProbe, FindsTheErrorOfTheHeadByTipAndShank) {
  Pulls across, along;
  for (std::uint64_t seed = 1; seed <= runs(40); ++seed) {
    const auto config = withSwitch(shankWorld(600 + seed), seed);
    Scenario scenario{config, seed};
    ASSERT_TRUE(qualified(scenario, 1));
    EXPECT_FALSE(procedure::whyUnready(procedure::kSwivelError, scenario.facts, false, procedure::ReadBy::shank));
    const auto result = runWithSwitch(scenario, procedure::kSwivelError, byShank(procedure::kSwivelError));
    ASSERT_TRUE(result);
    addErrors(across, along, scenario, *result,
              [&](double b_rad, double length_mm) { return errorOfShank(config, b_rad, length_mm); });
    EXPECT_EQ(std::get<double>(scenario.dataset().config.at("pre_travel_1_result")), 43);
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  across.expectHonest();
}

TEST(TriggerProbe, NeedsThePreTravelOfEveryToolThatItSwivels) {
  auto facts = usualFacts();
  facts.trigger_probe = procedure::TriggerProbe{.pre_travels = {{}, {.result_id = 1, .tool = 1}}};
  const auto why = [&](procedure::ReadBy by) {
    const auto error = procedure::whyUnready(procedure::kSwivelError, facts, true, by);
    return error ? error->what : std::string{};
  };
  EXPECT_THAT(why(procedure::ReadBy::tip), HasSubstr("tool 2"));
  EXPECT_THAT(why(procedure::ReadBy::tip), testing::AllOf(HasSubstr("calibrate pre-travel"), HasSubstr("--tool 2")));
  EXPECT_EQ(why(procedure::ReadBy::shank), "") << "of tool 1";
  facts.trigger_probe->pre_travels.push_back({.result_id = 2, .tool = 2});
  EXPECT_EQ(why(procedure::ReadBy::tip), "");
  facts.trigger_probe->pre_travels = {{}};
  EXPECT_THAT(why(procedure::ReadBy::shank), HasSubstr("tool 1"));
  facts.probe_tools = {};
  EXPECT_EQ(why(procedure::ReadBy::shank), "") << "no other tool carries the probe";
}

TEST(TriggerProbe, RefusesATipWhosePreTravelIsNotInForceAnyMore) {
  Scenario scenario{withSwitch(swivelWorld(9), 9), 9};
  for (const std::uint32_t tool : {1U, 2U}) ASSERT_TRUE(qualified(scenario, tool));
  const auto number = scenario.start(procedure::kSwivelError);
  scenario.facts.trigger_probe->pre_travels.pop_back();
  const auto solved = scenario.finish(number);
  ASSERT_TRUE(solved);
  ASSERT_FALSE(solved->ok());
  EXPECT_EQ(solved->error().name, "no-pre-travel");
  EXPECT_THAT(solved->error().reason, testing::AllOf(HasSubstr("calibrate pre-travel"), HasSubstr("--tool 2")));
}

TEST(TriggerProbe, IsQualifiedInToolsThatCarryItAlone) {
  auto facts = usualFacts();
  facts.trigger_probe = procedure::TriggerProbe{};
  const auto why = [&](std::uint32_t tool) {
    const auto ready = procedure::readied(procedure::kPreTravel, {.tool = tool}, facts, {});
    return ready ? std::string{} : ready.error().what;
  };
  EXPECT_EQ(why(2), "");
  EXPECT_THAT(why(4), testing::AllOf(HasSubstr("tool 4"), HasSubstr("1, 2")));
}

}  // namespace
}  // namespace probebox::scenario
