#include <array>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>

#include "drivers/world/random.hpp"
#include "firmware/app/results/values_in_use.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "measured.hpp"
#include "protocol/units/angle.hpp"
#include "pulls.hpp"

// periodic-check with the head at 0, 45 and 90 degrees on the emulated machine.
namespace probebox::scenario {
namespace {

using world::operator*;
using world::operator+;
using world::operator-;
using world::Vector3;

const std::uint64_t kCheckSeeds = runs(20);
constexpr double kHalfTurn_rad = std::numbers::pi;

// A head that swivels about some other line.
world::Config checkWorld(std::uint64_t seed) {
  world::Config config = usualWorld();
  world::Random random{seed, 99};
  for (const std::size_t i : {0U, 2U}) config.swivel_head->pivot_mm[i] += random.uniform(-0.02, 0.02);
  config.swivel_head->direction = {random.uniform(-2e-4, 2e-4), 1, random.uniform(-2e-4, 2e-4)};
  for (double& offset : config.probe_spindle.stylus_offset_mm) offset = random.uniform(-0.03, 0.03);
  return config;
}

// Where the machine stands with the stylus' ball in the middle of the part's, mean over A and C at 0 and 180.
Vector3 meanOf(const Scenario& scenario, const world::Config& config, double b_rad) {
  Vector3 mean{};
  const auto& part = config.part_spindle;
  for (const double c_rad : {0.0, kHalfTurn_rad}) {
    const Vector3 ball = part.point_mm + world::rotation(world::unit(part.direction), c_rad) * part.balls_mm[0];
    for (const double a_rad : {0.0, kHalfTurn_rad})
      mean = mean + 0.25 * (ball - scenario.machine().tipIn({.a_rad = a_rad, .head_rad = b_rad}, 1));
  }
  return mean;
}

ProcedureOptions checkOf(Scenario& scenario) {
  scenario.facts.checked_ball->swivels_rad = {45 * kDegree, 90 * kDegree};
  const auto options = procedure::described(procedure::kPeriodicCheck, {}, scenario.facts, procedure::ReadBy::tip);
  EXPECT_TRUE(options) << options.error().what;
  return options ? *options : ProcedureOptions{};
}

TEST(SwivelledCheck, ComparesTheAxesAtEveryAngleOfTheHead) {
  Pulls pulls, heights;
  for (std::uint64_t seed = 1; seed <= kCheckSeeds; ++seed) {
    const auto config = checkWorld(seed);
    Scenario scenario{config, seed};
    const auto options = checkOf(scenario);
    const auto result = measured(scenario, procedure::kPeriodicCheck, options);
    ASSERT_TRUE(result);
    const Vector3 level = meanOf(scenario, config, 0), half = meanOf(scenario, config, 45 * kDegree),
                  whole = meanOf(scenario, config, 90 * kDegree);
    add(pulls, *result, "Xcen_B0_mm", {level[0]}, 6e-4);
    add(pulls, *result, "Ycen_B0_mm", {level[1]}, 6e-4);
    add(pulls, *result, "Ycen_B45_mm", {half[1]}, 6e-4);
    add(pulls, *result, "Ycen_B90_mm", {whole[1]}, 6e-4);
    add(heights, *result, "Zcen_B90_mm", {whole[2]}, 8e-4);
    // At 90 degrees a stylus of 150 mm under a pivot of 60 points along -X, 210 mm from where it hangs at 0.
    const double off_mm = whole[0] - 210 - scenario.facts.checked_ball->accepted_x->mm;
    add(pulls, *result, "x_offset_error_mm", {off_mm}, 6e-4);
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  pulls.expectHonest();
  heights.expectHonest();
}

// It displaces all touches from one side alike: the scatter of the touches does not show it, the uncertainty does.
TEST(SwivelledCheck, DoesNotTakeTheDoubtOfTheDelayForScatter) {
  constexpr double kDoubt_s = 1e-4;
  Scenario scenario{checkWorld(5), 5};
  scenario.recorder().keeps_bytes = false;
  scenario.run(std::chrono::seconds{2});
  scenario.push(DelayActivated{
      .result_id = 7, .tau_s = scenario.truth().tau_s, .sd_s = {kDoubt_s, kDoubt_s, kDoubt_s}, .at = scenario.now()});
  const auto solved = scenario.calibrate(procedure::kPeriodicCheck, checkOf(scenario));
  ASSERT_TRUE(solved && solved->ok());
  const auto& result = solved->value();
  for (const auto& warning : result.warnings) EXPECT_EQ(warning.find("residuals-below-noise"), std::string::npos);
  for (const char* key : {"x_offset_error_mm", "z_offset_error_mm"}) {
    const auto* found = result.find(key);
    EXPECT_LT(found->sd[0], 6e-4) << key;
    EXPECT_NEAR(std::hypot(found->sd[0], 15 * kDoubt_s), found->uncertainty[0], 1e-4) << key << ", at 15 mm/s";
  }
}

// X at 90 degrees counts from the accepted turning axis.
TEST(SwivelledCheck, HoldsTheDoubtOfTheCheckInForce) {
  Scenario scenario{checkWorld(6), 6};
  auto& ball = *scenario.facts.checked_ball;
  ball.accepted_x->sd_mm = 2e-3, ball.accepted_y->sd_mm = 1e-3, ball.centre_z.sd_mm = 3e-3;
  const auto result = measured(scenario, procedure::kPeriodicCheck, checkOf(scenario));
  ASSERT_TRUE(result);
  const auto sdOf = [&](const char* key) { return result->find(key)->sd[0]; };
  EXPECT_NEAR(sdOf("deviation_Xcen_B0_mm"), std::hypot(2e-3, sdOf("Xcen_B0_mm")), 1e-9);
  EXPECT_NEAR(sdOf("deviation_Ycen_B45_mm"), std::hypot(1e-3, sdOf("Ycen_B45_mm")), 1e-9);
  EXPECT_NEAR(sdOf("deviation_x_offset_error_mm"), std::hypot(2e-3, sdOf("x_offset_error_mm")), 1e-9);
  EXPECT_GT(result->find("z_offset_error_mm")->uncertainty[0], 3e-3);
}

TEST(SwivelledCheck, FailsWhereTheHeadHasMoved) {
  auto config = usualWorld();
  config.swivel_head->pivot_mm[0] += 0.1;
  Scenario scenario{config, 3};
  scenario.facts.takeLength(1, scenario.facts.lengthOf(1), 42);
  scenario.facts.takeLength(2, scenario.facts.lengthOf(2), 43);
  const auto options = checkOf(scenario);
  const auto result = measured(scenario, procedure::kPeriodicCheck, options);
  ASSERT_TRUE(result);
  EXPECT_EQ(std::get<double>(scenario.dataset().config.at("length_1_result")), 42);
  EXPECT_FALSE(scenario.dataset().config.contains("length_2_result")) << "of a tool that was not read";
  EXPECT_EQ(result->find("verdict")->values[0], 2);
  EXPECT_GT(std::abs(result->find("deviation_x_offset_error_mm")->values[0]), 0.05);
  EXPECT_LT(std::abs(result->find("deviation_Xcen_B0_mm")->values[0]), 0.02) << "nothing shows at B = 0";
}

// A head with an error that a person has accepted: the next check is held against that one, at every angle.
TEST(SwivelledCheck, PassesWhereTheHeadIsAsItWasAccepted) {
  auto config = usualWorld();
  config.swivel_head->pivot_mm[0] += 0.1;
  config.swivel_head->direction = {1e-4, 1, 3e-4};
  procedure::MeasuredPlaces accepted;
  for (const std::uint64_t seed : {3U, 4U}) {
    Scenario scenario{config, seed};
    auto options = checkOf(scenario);
    procedure::takeMeasured(scenario.facts, accepted);
    const auto result = measured(scenario, procedure::kPeriodicCheck, options);
    ASSERT_TRUE(result);
    EXPECT_EQ(result->find("verdict")->values[0], seed == 3 ? 2 : 0);
    app::MeasuredFacts facts;
    store::Record record;
    record.binding.subject = "check";
    record.content = *result;
    app::addFacts(record, facts);
    accepted = facts;
    if (seed == 3) continue;
    for (const char* key : {"deviation_x_offset_error_mm", "deviation_Zcen_B90_mm", "deviation_Ycen_B90_mm"}) {
      ASSERT_NE(result->find(key), nullptr) << key;
      EXPECT_LT(std::abs(result->find(key)->value()), 0.003) << key;
    }
  }
}

TEST(SwivelledCheck, MissesNoAngleThatWasNeverRead) {
  Scenario scenario{usualWorld(), 4};
  ASSERT_TRUE(scenario.facts.checked_ball->accepted_y);
  const auto result = measured(scenario, procedure::kPeriodicCheck);
  ASSERT_TRUE(result);
  EXPECT_FALSE(scenario.dataset().config.contains("accepted_Ycen_B45_mm"));
  EXPECT_EQ(result->find("verdict")->values[0], 0);
}

TEST(SwivelledCheck, NeedsTheTurningAxisAndTheProbesLength) {
  auto facts = usualFacts();
  facts.checked_ball->swivels_rad = {90 * kDegree};
  facts.checked_ball->accepted_x.reset();
  const auto why = [&] {
    const auto options = procedure::described(procedure::kPeriodicCheck, {}, facts, procedure::ReadBy::tip);
    return options ? std::string{} : options.error().what;
  };
  EXPECT_NE(why().find("accepted_x_mm"), std::string::npos);
  facts.checked_ball->accepted_x = procedure::AcceptedValue{.mm = 330};
  EXPECT_EQ(why(), "");
  facts.probe_tools.count = 0;
  EXPECT_NE(why().find("[probe_tools] numbers"), std::string::npos);
}

}  // namespace
}  // namespace probebox::scenario
