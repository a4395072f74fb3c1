#include <array>
#include <chrono>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <optional>
#include <vector>

#include "drivers/world/random.hpp"
#include "firmware/app/results/result_events.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "measured.hpp"
#include "plate_truth.hpp"
#include "pulls.hpp"
#include "touch_trigger_probe.hpp"

// A box with a touch-trigger probe, which delivers edges of its switch and no samples, on the emulated machine.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using procedure::LiveMethod;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::uint64_t kSwitchSeeds = runs(20);

// A switch with some other pre-travel, late by some other time, that chatters.
world::Config switchWorld(std::uint64_t seed) {
  world::Config config = usualWorld();
  world::Random random{seed, 91};
  config.touch_trigger = someSwitch(random);
  config.part_spindle.point_mm[0] += random.uniform(-0.05, 0.05);
  config.part_spindle.point_mm[1] += random.uniform(-0.05, 0.05);
  return config;
}

// Where axis C passes the height of the ball, relative to the machine's reference with the stylus at A = 0.
std::vector<double> centreOf(const Scenario& scenario, const world::Config& config, double z_mm) {
  const auto truth = scenario.truth();
  std::vector<double> at(2);
  for (std::size_t i = 0; i < 2; ++i) {
    at[i] = truth.part_axis_point_mm[i] +
            truth.part_axis[i] / truth.part_axis[2] * (z_mm - truth.part_axis_point_mm[2]) -
            config.probe_spindle.stylus_offset_mm[i];
  }
  return at;
}

// From the axis of the probe's spindle to axis C, each at the height at which it is passed.
std::vector<double> offsetOf(const world::Config& config) {
  const auto& part = config.part_spindle;
  const auto c = world::unit(part.direction), a = world::unit(config.probe_spindle.direction);
  const auto& off = config.probe_spindle.stylus_offset_mm;
  const world::Vector3 hanging{off[0], off[1], -config.probe_spindle.stylus_length_mm};
  const double along_c = world::dot(c, part.balls_mm[0]), along_a = world::dot(a, hanging);
  return {part.point_mm[0] + along_c * c[0] - along_a * a[0], part.point_mm[1] + along_c * c[1] - along_a * a[1]};
}

// Y and Z of the table's axis, for positions of a stylus that hangs off its spindle's axis.
std::vector<double> pivotOf(const Scenario& scenario, const world::Config& config) {
  const auto& table = *config.tilting_table;
  const auto& x = *scenario.dataset().table("readings")->column("x_mm");
  double x_mm = 0;
  for (const double each : x) x_mm += each / static_cast<double>(x.size());
  const auto& off = config.probe_spindle.stylus_offset_mm;
  const double along = (x_mm + off[0] - table.point_mm[0]) / table.direction[0];
  return {table.point_mm[1] + along * table.direction[1] - off[1], table.point_mm[2] + along * table.direction[2]};
}

TEST(TriggerProbe, ShowsItsPreTravelByDirection) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= kSwitchSeeds; ++seed) {
    const auto config = switchWorld(seed);
    Scenario scenario{config, seed};
    const auto result = qualified(scenario);
    ASSERT_TRUE(result);
    const auto& trigger = *config.touch_trigger;
    add(pulls, *result, "pre_travel_mm", {trigger.pre_travel_mm, trigger.lobe_mm, 0, trigger.axial_mm}, 6e-4);
    // The switch closes nearer to the surface than it opens; a reading is the mean of both, in all directions.
    add(pulls, *result, "radius_error_mm", {trigger.hysteresis_mm / 2}, 6e-4);
    EXPECT_NEAR(result->find("switch_late_s")->value(), trigger.late_s - config.delays.tau_machine_s[0], 1e-4);
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  pulls.expectHonest();
}

TEST(TriggerProbe, FindsAxesAsWellAsItSays) {
  Pulls centre, pivot;
  for (std::uint64_t seed = 1; seed <= kSwitchSeeds; ++seed) {
    const auto config = switchWorld(100 + seed);
    Scenario scenario{config, seed};
    ASSERT_TRUE(qualified(scenario));
    const auto found = runWithSwitch(scenario, procedure::kCentreline, {.angles = 5});
    ASSERT_TRUE(found);
    addWhole(centre, *found, "centre_mm", centreOf(scenario, config, -160), 1e-3);
    EXPECT_TRUE(found->warnings.empty()) << found->warnings.front();
    EXPECT_EQ(scenario.dataset().table("probe"), nullptr) << "there are no samples";
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *found);
    const auto tilted = runWithSwitch(scenario, procedure::kTablePivot);
    ASSERT_TRUE(tilted);
    addWhole(pivot, *tilted, "pivot_yz_mm", pivotOf(scenario, config), 2e-3);
  }
  centre.expectHonest();
  pivot.expectHonest();
}

// What the sensor head measures without touching, and what such a box does in its place.
TEST(TriggerProbe, FindsTheErrorsOfARotaryAxisByTouchingItsBalls) {
  Pulls translations, rotations;
  for (std::uint64_t seed = 1; seed <= runs(8); ++seed) {
    auto config = turningWorld(500 + seed);
    world::Random random{seed, 95};
    config.touch_trigger = someSwitch(random);
    Scenario scenario{config, seed};
    ASSERT_TRUE(qualified(scenario));
    const auto result = runWithSwitch(scenario, procedure::kRotaryAxisErrors, {.angles = 5});
    ASSERT_TRUE(result);
    const auto& six = *result->find("six_errors");
    ASSERT_EQ(six.uncertainty.size(), 30U);
    for (std::size_t stop = 0; stop < 5; ++stop) {
      const auto truth = trueErrors(config, scenario.machine(), 2 * std::numbers::pi / 5 * static_cast<double>(stop));
      for (std::size_t e = 0; e < 6; ++e) {
        const double u = six.uncertainty[6 * stop + e];
        EXPECT_LT(u, e < 3 ? 2e-3 : 5e-5);
        (e < 3 ? translations : rotations).add(six.values[6 * stop + e], truth[e], u);
      }
    }
  }
  translations.expectHonest();
  rotations.expectHonest();
}

// Half of the readings have A at 90 or 270 degrees, so lobes that did not turn with the probe would move the centres.
TEST(TriggerProbe, TurnsItsLobesWithTheSpindle) {
  Pulls offset;
  for (std::uint64_t seed = 1; seed <= kSwitchSeeds; ++seed) {
    const auto config = switchWorld(200 + seed);
    Scenario scenario{config, seed};
    ASSERT_TRUE(qualified(scenario));
    const auto found = runWithSwitch(scenario, procedure::kSpindleOffsetFour);
    ASSERT_TRUE(found);
    addWhole(offset, *found, "offset_C_minus_A_mm", offsetOf(config), 1e-3);
  }
  offset.expectHonest();
}

TEST(TriggerProbe, TurnsItsLobesWithTheHead) {
  Pulls pivot;
  for (std::uint64_t seed = 1; seed <= kSwitchSeeds; ++seed) {
    auto config = switchWorld(300 + seed);
    world::Random random{seed, 92};
    for (const std::size_t i : {0U, 2U}) config.swivel_head->pivot_mm[i] += random.uniform(-0.05, 0.05);
    Scenario scenario{config, seed};
    ASSERT_TRUE(qualified(scenario));
    const auto found = runWithSwitch(scenario, procedure::kHeadPivot);
    ASSERT_TRUE(found);
    const auto& pivot_mm = config.swivel_head->pivot_mm;
    // Positions are those of the first tool's stylus ball, 150 mm below the reference.
    addWhole(pivot, *found, "pivot_xz_mm", {pivot_mm[0], pivot_mm[2] + 150}, 2e-3);
  }
  pivot.expectHonest();
}

// Each tool has a pre-travel of its own, and none is in force: it is in the offset of its stylus, and not in the tilt.
TEST(TriggerProbe, FindsTheLeanOfItsSpindleWithoutAPreTravel) {
  for (const auto by : {procedure::ReadBy::tip, procedure::ReadBy::shank}) {
    Pulls tilt;
    for (std::uint64_t seed = 1; seed <= kSwitchSeeds; ++seed) {
      auto config = switchWorld(400 + seed);
      world::Random random{seed, 93};
      for (const std::size_t i : {0U, 1U}) config.probe_spindle.direction[i] = random.uniform(-3e-4, 3e-4);
      Scenario scenario{config, seed};
      scenario.facts.trigger_probe = procedure::TriggerProbe{.repeatability_mm = 4e-4};
      scenario.run(2s);
      EXPECT_FALSE(procedure::whyUnready(procedure::kAAxisAlignment, scenario.facts, false, by));
      const auto options = procedure::described(procedure::kAAxisAlignment, {}, scenario.facts, by);
      const auto found = runWithSwitch(scenario, procedure::kAAxisAlignment, *options);
      ASSERT_TRUE(found);
      const auto& direction = config.probe_spindle.direction;
      addWhole(tilt, *found, "A_tilt_rad", {direction[0], direction[1]}, 4e-5);
      EXPECT_EQ(metrology::subjectsOf(scenario.dataset()).size(), 1U) << "the lobes are in the offsets of the styli";
      EXPECT_EQ(scenario.dataset().config.count("pre_travel_result"), 0U);
      if (seed > 1) continue;
      expectTheSameFrom(scenario.dataset(), *found);
      EXPECT_THAT(found->unobservable, testing::Contains(HasSubstr("pre-travel")));
    }
    tilt.expectHonest(Pulls::kCautious);
  }
}

TEST(TriggerProbe, RefusesAReadingWhosePreTravelIsNotInForceAnyMore) {
  Scenario scenario{switchWorld(8), 8};
  ASSERT_TRUE(qualified(scenario));
  const auto number = scenario.start(procedure::kCentreline);
  scenario.facts.trigger_probe->pre_travels.clear();
  const auto solved = scenario.finish(number);
  ASSERT_TRUE(solved);
  ASSERT_FALSE(solved->ok());
  EXPECT_EQ(solved->error().name, "no-pre-travel");
  EXPECT_THAT(solved->error().reason, HasSubstr("calibrate pre-travel"));
}

TEST(TriggerProbe, RunsEveryMethodThatReadsBallsOrTheSettingDevice) {
  Scenario scenario{switchWorld(7), 7};
  for (const std::uint32_t tool : {0U, 1U, 2U}) ASSERT_TRUE(qualified(scenario, tool));
  std::vector<std::string_view> ran;
  for (const LiveMethod* method : procedure::liveMethods()) {
    if (procedure::whyUnready(*method, scenario.facts, false)) continue;
    const bool measures_tool = method->takes_tool;
    if (method->kind != procedure::Kind::touch || method == &procedure::kPreTravel) continue;
    auto wanted = measures_tool ? ProcedureOptions{.tool = 4} : ProcedureOptions{};
    if (method == &procedure::kCentrelineX) wanted.mounts = 1;  // the ball of this machine stays where it is
    const auto options = procedure::described(*method, wanted, scenario.facts);
    ASSERT_TRUE(options.ok()) << options.error().what;
    EXPECT_TRUE(runWithSwitch(scenario, *method, *options)) << method->name();
    ran.push_back(method->name());
  }
  EXPECT_THAT(ran,
              testing::UnorderedElementsAre("a-axis-alignment", "c-axis-alignment", "centreline", "centreline-by-steps",
                                            "centreline-limited-access", "centreline-x", "head-pivot", "periodic-check",
                                            "rotary-axis-errors", "spindle-offset-2x2", "spindle-offset-four",
                                            "swivel-error", "table-pivot", "tool-assembly", "tool-setter"));
}

TEST(TriggerProbe, NeedsItsPreTravelBeforeItFindsAPlace) {
  auto facts = usualFacts();
  facts.trigger_probe = procedure::TriggerProbe{};
  const auto why = procedure::whyUnready(procedure::kCentreline, facts, true);
  ASSERT_TRUE(why);
  EXPECT_THAT(why->what, HasSubstr("calibrate pre-travel"));
  facts.trigger_probe->pre_travels = {procedure::PreTravel{}};
  EXPECT_FALSE(procedure::whyUnready(procedure::kCentreline, facts, false)) << "and no delay";
  EXPECT_FALSE(procedure::whyUnready(procedure::kToolSetter, facts, false));
  facts.trigger_probe.reset();
  EXPECT_THAT(procedure::whyUnready(procedure::kPreTravel, facts, true)->what, HasSubstr("kind = \"trigger\""));
}

TEST(TriggerProbe, IsRefusedWhereItCannotGiveTheReadings) {
  auto facts = usualFacts();
  facts.trigger_probe = procedure::TriggerProbe{.pre_travels = {procedure::PreTravel{}}};
  for (const auto* method : {&procedure::kDelayMultiSpeed, &procedure::kDelayPlates, &procedure::kDelayInOut})
    EXPECT_THAT(procedure::whyUnready(*method, facts, true)->what, HasSubstr("touch-trigger"));
  EXPECT_THAT(procedure::whyUnready(procedure::kSelftest, facts, true)->what, HasSubstr("no channels"));
  EXPECT_THAT(procedure::whyUnready(procedure::kSensorHeadCalibration, facts, true)->what,
              AllOf(HasSubstr("channels"), Not(HasSubstr("--head"))));
  const auto& rotary = procedure::kRotaryAxisErrors;
  EXPECT_THAT(procedure::whyUnready(rotary, facts, true, procedure::ReadBy::head)->what, HasSubstr("--head"));
  EXPECT_FALSE(procedure::whyUnready(rotary, facts, true)) << "as that remedy says";
  facts.sensor_head->calibrated.reset();
  const auto by_head = procedure::readied(rotary, {.head = true}, facts, {});
  ASSERT_FALSE(by_head.ok());
  EXPECT_THAT(by_head.error().what, HasSubstr("omit --head")) << "a calibration of the head would be refused";
  const auto ready = procedure::readied(procedure::kCentreline, {.overtravel_mm = 0.1}, facts, {});
  ASSERT_FALSE(ready.ok());
  EXPECT_THAT(ready.error().what, HasSubstr("0.3"));
}

TEST(TriggerProbe, IsNotQualifiedWhereItsShankWouldTouchTheSphere) {
  auto facts = usualFacts();
  facts.trigger_probe = procedure::TriggerProbe{};
  const auto why = [&](const ProcedureOptions& asked) {
    const auto ready = procedure::readied(procedure::kPreTravel, asked, facts, {});
    return ready ? std::string{} : ready.error().what;
  };
  EXPECT_EQ(why({}), "") << "the shank that is described begins above the sphere";
  EXPECT_THAT(why({.overtravel_mm = 1}), HasSubstr("larger stylus"));
  facts.probe_shank->from_mm = 5;
  EXPECT_THAT(why({}), HasSubstr("5 mm"));
  facts.probe_shank->radius_mm = 1.5;
  EXPECT_EQ(why({}), "");
}

}  // namespace
}  // namespace probebox::scenario
