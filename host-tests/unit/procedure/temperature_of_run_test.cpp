#include <algorithm>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <memory>
#include <optional>
#include <string>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/poses.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "obedient_machine.hpp"

// The temperature that a person states for one run, in the place of that of machine.toml.
namespace probebox::procedure {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

RunDataset measured(const LiveMethod& method, const Facts& facts) {
  Procedure procedure{liveMethods(), capture::Capacity{}};
  ObedientMachine machine{procedure};
  procedure.start({.run = 1, .method = method.number, .at = {}, .options = {}});
  while (procedure.progress().state == State::waiting) machine.touch();
  return runDataset(method, procedure.recording(), {}, facts);
}

double numberAt(const RunDataset& run, const std::string& key) {
  return std::get<double>(run.dataset.config.at(key));
}

Facts withSphere(std::optional<SphereTemperature> temperature) {
  Facts facts;
  facts.sphere_diameter_mm = 25;
  facts.sphere_temperature = temperature;
  return facts;
}

TEST(TemperatureOfARun, ReplacesThatOfTheDescription) {
  Facts facts = withSphere(SphereTemperature{.celsius = 23.5, .sd_k = 0.5, .expansion_per_k = 11.5e-6});
  EXPECT_EQ(numberAt(measured(kDelayKnownSphere, facts), "temperature_c"), 23.5);
  facts.temperature_c = 26.25;
  const auto run = measured(kDelayKnownSphere, facts);
  EXPECT_EQ(numberAt(run, "temperature_c"), 26.25);
  EXPECT_EQ(numberAt(run, "expansion_per_k"), 11.5e-6);
  EXPECT_EQ(numberAt(run, "sd_temperature_k"), 0.5);
  EXPECT_THAT(run.warnings, IsEmpty());
}

TEST(SizesOfARun, HaveTheSdThatIsDescribed) {
  Facts facts = withSphere({});
  facts.stylus_ball_diameter_mm = 6;
  EXPECT_FALSE(measured(kDelayKnownSphere, facts).dataset.config.contains("sd_effective_diameter_mm"));
  facts.sd_sphere_diameter_mm = 4e-4;
  EXPECT_EQ(numberAt(measured(kDelayKnownSphere, facts), "sd_effective_diameter_mm"), 4e-4);
  facts.gaps[0] = KnownSize{26, 5e-4};
  EXPECT_EQ(numberAt(measured(kDelayPlates, facts), "sd_gap_mm"), 5e-4);
}

// What machine.toml says of the machine's own errors; nothing where it says nothing, so that cautious values hold.
TEST(AccuracyOfARun, IsInTheCaseOfEveryMethod) {
  Facts facts = withSphere({});
  facts.gaps[0] = KnownSize{26};
  for (const LiveMethod* method : {&kDelayKnownSphere, &kDelayPlates, &kCentreline}) {
    facts.accuracy = MachineAccuracy{.scale_ppm = 3, .squareness_urad = 4, .lost_motion_um = 0, .drift_um_per_min = 0};
    const auto run = measured(*method, facts);
    EXPECT_EQ(numberAt(run, "scale_ppm"), 3);
    EXPECT_EQ(numberAt(run, "squareness_urad"), 4);
    EXPECT_EQ(numberAt(run, "lost_motion_um"), 0);
    EXPECT_EQ(numberAt(run, "drift_um_per_min"), 0);
    facts.measured_errors = {{&kMachineErrors[2], 1.5}};
    EXPECT_EQ(numberAt(measured(*method, facts), "lost_motion_um"), 1.5) << "what was measured goes before";
    facts.accuracy.reset();
    EXPECT_EQ(numberAt(measured(*method, facts), "lost_motion_um"), 1.5);
    facts.measured_errors.clear();
    for (const auto& error : kMachineErrors)
      EXPECT_FALSE(measured(*method, facts).dataset.config.contains(error.key)) << error.key;
  }
}

// A forecast can propose the speeds that a run has unless others are asked for.
TEST(SpeedSets, HaveTheUsualSpeeds) {
  for (const LiveMethod* method : liveMethods()) {
    if (method->speed_sets.empty()) continue;
    const auto usual = speedsOf(method->usual);
    EXPECT_TRUE(std::ranges::any_of(method->speed_sets, [&](auto set) { return std::ranges::equal(set, usual); }))
        << method->name();
  }
}

TEST(TemperatureOfARun, IsEnoughWhereTheExpansionAloneIsDescribed) {
  Facts facts = withSphere(SphereTemperature{.celsius = {}, .sd_k = 0.5, .expansion_per_k = 11.5e-6});
  const auto without = measured(kDelayKnownSphere, facts);
  for (const auto* key : {"temperature_c", "expansion_per_k", "sd_temperature_k"})
    EXPECT_FALSE(without.dataset.config.contains(key)) << key;
  facts.temperature_c = 26;
  const auto run = measured(kDelayKnownSphere, facts);
  EXPECT_EQ(numberAt(run, "temperature_c"), 26);
  EXPECT_EQ(numberAt(run, "expansion_per_k"), 11.5e-6);
}

TEST(TemperatureOfARun, IsForTheRecordWhereNoExpansionIsDescribedAndSaysSo) {
  Facts facts = withSphere({});
  facts.temperature_c = 26;
  const auto known = measured(kDelayKnownSphere, facts);
  EXPECT_EQ(numberAt(known, "temperature_c"), 26);
  EXPECT_THAT(known.warnings,
              testing::ElementsAre(testing::AllOf(HasSubstr("[datum_sphere]"), HasSubstr("expansion_per_k"),
                                                  HasSubstr("machine.toml"))));
  facts.gaps[0] = KnownSize{26};
  EXPECT_THAT(measured(kDelayPlates, facts).warnings, IsEmpty()) << "no description could state how a gap expands";
  const auto unknown = measured(kCentreline, facts);
  EXPECT_EQ(numberAt(unknown, "temperature_c"), 26) << "of every method";
  EXPECT_THAT(unknown.warnings, IsEmpty()) << "no known size";
}

TEST(TemperatureOfARun, IsInThePlanOfItsOptionsAndRefusedInOtherUnits) {
  const auto plan = std::make_unique<Plan>();
  fill(*plan, kDelayKnownSphere, {});
  EXPECT_FALSE(plan->temperature_c);
  ProcedureOptions options;
  options.has_temperature = true;
  options.temperature_c = 0;
  options.axis = 1;
  fill(*plan, kScrewCalibration, options);
  EXPECT_EQ(plan->temperature_c, 0.0) << "of freezing point, and of a method with steps of its own";
  for (const double wrong : {297.0, -31.0, std::numeric_limits<double>::quiet_NaN()}) {
    options.temperature_c = wrong;
    options.axis = 0;
    const auto why = validate(kDelayKnownSphere, options, 10);
    ASSERT_TRUE(why) << wrong;
    EXPECT_THAT(why->what, testing::AllOf(HasSubstr("-30"), HasSubstr("70 degrees")));
  }
}

}  // namespace
}  // namespace probebox::procedure
