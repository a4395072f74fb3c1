// Certificates in a forecast: what u holds beside the readings, and how far runs on pieces that are off then are.
#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>
#include <random>

#include "firmware/metrology/solve.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "host-tests/metrology/moments.hpp"
#include "host-tests/support/runs.hpp"
#include "tools/plan/completed.hpp"
#include "tools/plan/forecast.hpp"
#include "tools/plan/simulated_facts.hpp"
#include "tools/plan/simulated_recording.hpp"

namespace probebox::plan {
namespace {

using procedure::LiveMethod;
using testing::Contains;
using testing::Not;

constexpr double kSdSphere_mm = 0.0005, kSdStylus_mm = 0.0003, kSdWarm_k = 0.5, kExpansion = 11.5e-6;

SetUp certified() {
  plan::SetUp set_up;
  set_up.sd_sphere_diameter_mm = kSdSphere_mm;
  set_up.sd_stylus_ball_diameter_mm = kSdStylus_mm;
  set_up.sphere_temperature =
      procedure::SphereTemperature{.celsius = 24, .sd_k = kSdWarm_k, .expansion_per_k = kExpansion};
  return set_up;
}

Forecast forecastFor(const LiveMethod& method, const SetUp& set_up, const ProcedureOptions& options = {}) {
  auto expected = forecast({.method = &method, .options = options}, set_up);
  EXPECT_TRUE(expected) << method.name() << ": " << expected.error().reason;
  return expected ? *expected : Forecast{};
}

// Of the first value: what u holds beside its sd.
double besideSd(const Forecast& forecast) {
  const auto& first = forecast.estimates.at(0);
  return std::sqrt(std::pow(first.uncertainty.at(0), 2) - std::pow(first.sd.at(0), 2));
}

// Ways in and out tell the delay by themselves, and the size is checked by them.
TEST(CertificatesInAForecast, AreNotInADelayFromTouches) {
  for (const auto* method : {&procedure::kDelayKnownSphere, &procedure::kDelayPlates}) {
    SCOPED_TRACE(std::string{method->name()});
    const auto bare = forecastFor(*method, {});
    const auto stated = forecastFor(*method, certified());
    EXPECT_DOUBLE_EQ(besideSd(bare), 0);
    EXPECT_LT(besideSd(stated), 0.01 * stated.estimates.at(0).sd.at(0));
    EXPECT_NEAR(stated.estimates.at(0).sd.at(0), bare.estimates.at(0).sd.at(0), 0.05 * bare.estimates.at(0).sd.at(0));
  }
  EXPECT_THAT(forecastFor(procedure::kDelayPlates, certified()).taken_as_exact, Contains("sd_gap_mm"));
}

// Of a run on pieces that are off from what is stated, as much as their sd say.
double errorOfRun(const LiveMethod& method, const SetUp& stated, std::uint64_t seed) {
  std::mt19937_64 random{seed};
  std::normal_distribution<double> normal;
  SetUp truly = stated;
  truly.sphere_diameter_mm += stated.sd_sphere_diameter_mm * normal(random);
  truly.stylus_ball_diameter_mm += stated.sd_stylus_ball_diameter_mm * normal(random);
  *truly.sphere_temperature->celsius += stated.sphere_temperature->sd_k * normal(random);
  const auto facts = factsOf(stated, 0);
  const auto options = completed({.method = &method}, facts);
  EXPECT_TRUE(options) << options.error().reason;
  const auto plan = std::make_unique<procedure::Plan>();
  procedure::fill(*plan, method, *options);
  SimulatedRecording run{truly, facts, seed};
  for (std::size_t i = 0; i < plan->step_count; ++i) EXPECT_TRUE(run.take(plan->steps[i]));
  const auto solved = metrology::solve(procedure::runDataset(method, run.recording(), run.scales(), facts).dataset);
  EXPECT_TRUE(solved) << solved.error().reason;
  return solved ? solved->find("tau_s")->value() - stated.delay_s : 0;
}

// Neither smaller nor larger, though the pieces are off.
TEST(CertificatesInAForecast, AreHowFarRunsOnSuchPiecesAreOff) {
  for (const auto* method : {&procedure::kDelayKnownSphere, &procedure::kDelayPlates}) {
    SCOPED_TRACE(std::string{method->name()});
    const std::uint64_t count = runs(40);
    const plan::SetUp stated = certified();
    const auto expected = forecastFor(*method, stated);
    metrology::Moments errors;
    for (std::uint64_t run = 1; run <= count; ++run)
      errors.add(errorOfRun(*method, stated, 100 + run), expected.estimates.front().uncertainty.front());
    metrology::expectHonest(errors, count);
  }
}

// The height of the ball rests on the delay of the way down, whose error every touch shares.
TEST(CertificatesInAForecast, HoldTheDelayInForceWhereARunDoes) {
  plan::SetUp set_up;
  EXPECT_THAT(forecastFor(procedure::kPeriodicCheck, set_up).in_u, Not(Contains("sd_effective_ball_radius_mm")));
  set_up.sd_delay_s = {2e-6, 2e-6, 2e-6};
  EXPECT_THAT(forecastFor(procedure::kPeriodicCheck, set_up).in_u, Contains("sd_effective_ball_radius_mm"));
}

// Deviations from what is accepted are as uncertain as that, too.
TEST(CertificatesInAForecast, HoldWhatWasAcceptedBeforeACheck) {
  plan::SetUp set_up;
  set_up.sd_accepted_mm = {0.003, 0.004};
  set_up.check_limit_mm = 0.02;
  const auto check = forecastFor(procedure::kPeriodicCheck, set_up);
  const auto uOf = [](const std::vector<metrology::Estimate>& all, const char* key) {
    const auto found = std::ranges::find(all, key, &metrology::Estimate::key);
    EXPECT_NE(found, all.end()) << key;
    return found == all.end() ? 0 : found->uncertainty.at(0);
  };
  const double of_x_mm = uOf(check.estimates, "Xcen_B0_mm"), of_y_mm = uOf(check.estimates, "Ycen_B0_mm");
  EXPECT_NEAR(uOf(check.also, "deviation_Xcen_B0_mm"), std::hypot(of_x_mm, 0.003), 1e-4);
  EXPECT_NEAR(uOf(check.also, "deviation_Ycen_B0_mm"), std::hypot(of_y_mm, 0.004), 1e-4);
}

// The fit has its coordinates as unknowns.
TEST(CertificatesInAForecast, OfAPlateAreNotTakenAsExactWhereStated) {
  plan::SetUp set_up;
  const auto exact = forecastFor(procedure::kRotaryAxisErrors, set_up, {.angles = 6});
  EXPECT_THAT(exact.taken_as_exact, Contains("sd_certificate_mm"));
  set_up.sd_plate_mm = 0.002;
  const auto rough = forecastFor(procedure::kRotaryAxisErrors, set_up, {.angles = 6});
  EXPECT_THAT(rough.taken_as_exact, Not(Contains("sd_certificate_mm")));
}

// Two speeds tell lost motion apart from the delay: where little is known of it they come first.
TEST(AccuracyInAForecast, DecidesWhichRunIsTheMostPrecise) {
  plan::SetUp rough;
  rough.accuracy = MachineAccuracy{
      .scale_ppm = 0, .squareness_urad = 0, .lost_motion_um = 20, .drift_um_per_min = 0, .probing_form_um = 0};
  const auto found = proposals({.method = &procedure::kDelayKnownSphere}, rough, 60);
  ASSERT_TRUE(found);
  ASSERT_GT(found->size(), 2U);
  for (std::size_t i = 1; i < found->size(); ++i)
    EXPECT_LE((*found)[i - 1].estimates.front().uncertainty.front(), (*found)[i].estimates.front().uncertainty.front());
  EXPECT_GT(found->front().wanted.options.speed_count, 1U);
}

TEST(Forecast, RefusesAToolThatIsNotDescribedAsTheBoxDoes) {
  plan::SetUp set_up;
  set_up.tools = {{.number = 7, .length_mm = 90, .sd_mm = 0.001}};
  const auto refused = forecast({.method = &procedure::kToolSetter, .options = {.tool = 4}}, set_up);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().name, "bad-option");
  EXPECT_THAT(refused.error().reason, testing::HasSubstr("of 7"));
  EXPECT_TRUE(forecast({.method = &procedure::kToolSetter, .options = {.tool = 7}}, set_up));
}

}  // namespace
}  // namespace probebox::plan
