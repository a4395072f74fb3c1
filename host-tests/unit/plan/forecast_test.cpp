// What is promised before measuring, against what many measurements then do.
#include "tools/plan/forecast.hpp"

#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "host-tests/metrology/moments.hpp"
#include "host-tests/support/runs.hpp"
#include "tools/plan/completed.hpp"
#include "tools/plan/simulated_facts.hpp"
#include "tools/plan/simulated_recording.hpp"
#include "tools/plan/simulated_run.hpp"

namespace probebox::plan {
namespace {

using procedure::LiveMethod;

double sdOf(const Forecast& forecast, std::string_view key, std::size_t component = 0) {
  for (const auto& estimate : forecast.estimates) {
    if (estimate.key == key) return estimate.sd.at(component);
  }
  ADD_FAILURE() << "no " << key;
  return 0;
}

Forecast forecastOf(const LiveMethod* method, const ProcedureOptions& options = {}, const SetUp& set_up = {}) {
  auto expected = forecast({.method = method, .options = options}, set_up);
  EXPECT_TRUE(expected) << expected.error().reason;
  return expected ? *expected : Forecast{};
}

ProcedureOptions atSpeeds(std::initializer_list<double> speeds_mm_s) {
  ProcedureOptions options;
  options.speed_count = static_cast<std::uint8_t>(speeds_mm_s.size());
  std::ranges::copy(speeds_mm_s, options.speeds_mm_s.begin());
  return options;
}

// Number of runs whose scatter is compared with a forecast. Of fewer than 15 the limits would be wide.
std::uint64_t comparedRuns(std::uint64_t all) {
  return std::max<std::uint64_t>(15, runs(all));
}

// By how much the root mean square of so many errors may differ from 1: 2.2 times its own scatter, 1 / sqrt(2 n), and
// a tenth that a forecast may be off; at most 0.4.
double scatterOf(std::uint64_t errors) {
  return std::min(0.4, 0.1 + 2.2 / std::sqrt(2 * static_cast<double>(errors)));
}

// Root mean square of the errors over its forecast: near 1 for runs that the forecast has not seen.
void expectScatterAsForecast(const Wanted& wanted, const char* key, double truth, std::uint64_t all,
                             const SetUp& set_up = {}) {
  const std::uint64_t count = comparedRuns(all);
  const double sd = sdOf(forecastOf(wanted.method, wanted.options, set_up), key);
  double squares = 0;
  for (std::uint64_t run = 0; run < count; ++run) {
    const auto measured = simulatedRun(*wanted.method, wanted.options, set_up, 1000 + run);
    ASSERT_TRUE(measured.solved) << measured.solved.error().reason;
    squares += std::pow((measured.solved->find(key)->values.front() - truth) / sd, 2);
  }
  EXPECT_NEAR(std::sqrt(squares / static_cast<double>(count)), 1, scatterOf(count));
}

TEST(Forecast, IsWhatRunsThenScatterBy) {
  const plan::SetUp set_up;
  for (const auto* method : {&procedure::kDelayMultiSpeed, &procedure::kDelayPlates, &procedure::kDelayInOut})
    expectScatterAsForecast({.method = method}, "tau_s", set_up.delay_s, 60);
}

TEST(Forecast, OfScansIsWhatRunsThenScatterBy) {
  const plan::SetUp set_up;
  Wanted scan{.method = &procedure::kDelaySteppedScan};
  scan.options.reach_mm = 15.5;
  for (const auto* method : {&procedure::kDelaySteppedScan, &procedure::kDelayContour}) {
    scan.method = method;
    expectScatterAsForecast(scan, "tau_s", set_up.delay_s, 30);
  }
}

// sd of what was found on the way; its forecast is that of the first simulated run.
double alsoSdOf(const std::vector<metrology::Estimate>& also, std::string_view key) {
  const auto found = std::ranges::find(also, key, &metrology::Estimate::key);
  EXPECT_NE(found, also.end()) << key;
  return found == also.end() ? 0 : found->standardDeviation().value_or(0);
}

constexpr double kFoundBy_rad = 0.01;  // by which the simulated set-up has the ball beside the line

// C turned until the ball touches, which the loops begin from.
void expectForecastOfContacts(const SetUp& set_up) {
  Wanted rim{.method = &procedure::kCentrelineBySteps};
  rim.options.contacts = true;
  const auto expected = forecastOf(rim.method, rim.options, set_up);
  const auto options = completed(rim, factsOf(set_up, 0));
  ASSERT_TRUE(options) << options.error().reason;
  const double shift_sd = alsoSdOf(expected.also, "contact_shift_rad");
  const std::uint64_t count = comparedRuns(40);
  const auto n = static_cast<double>(count);
  std::vector<double> shifts;
  double centre_squares = 0;
  for (std::uint64_t run = 0; run < count; ++run) {
    const auto measured = simulatedRun(*rim.method, *options, set_up, 1000 + run);
    ASSERT_TRUE(measured.solved) << measured.solved.error().reason;
    shifts.push_back(measured.solved->find("contact_shift_rad")->value());
    const auto& centre = *measured.solved->find("centre_mm");
    for (std::size_t k = 0; k < 2; ++k)
      centre_squares += std::pow(centre.values[k] / sdOf(expected, "centre_mm", k), 2) / 2;
  }
  double mean = 0, shift_squares = 0;
  for (const double shift : shifts) mean += shift / n;
  for (const double shift : shifts) shift_squares += std::pow((shift - mean) / shift_sd, 2);
  EXPECT_NEAR(std::sqrt(shift_squares / (n - 1)), 1, scatterOf(count));
  EXPECT_NEAR(mean, kFoundBy_rad, 5 * shift_sd / std::sqrt(n));
  EXPECT_NEAR(std::sqrt(centre_squares / n), 1, scatterOf(2 * count)) << "of two coordinates";
}

TEST(Forecast, OfContactsOfATouchTriggerProbeIsWhatRunsThenScatterBy) {
  plan::SetUp set_up;
  set_up.switch_repeatability_um = 0.25;
  set_up.sd_pre_travel_um = 1e-3;  // what is in force is the same in every run
  expectForecastOfContacts(set_up);
}

TEST(Forecast, OfContactsOfAScanningProbeIsWhatRunsThenScatterBy) {
  expectForecastOfContacts({});
}

// A pre-travel along the tool is in the answer as a length of the tool is.
TEST(Forecast, OfASwivelErrorByTouchTriggerHoldsThePreTravelOfEachTool) {
  const Wanted wanted{.method = &procedure::kSwivelError};
  plan::SetUp set_up;
  set_up.switch_repeatability_um = 0.25;
  set_up.sd_pre_travel_um = 1e-3;
  const auto exact = forecast(wanted, set_up);
  ASSERT_TRUE(exact) << exact.error().reason;
  set_up.sd_pre_travel_um = 2;
  const auto rough = forecast(wanted, set_up);
  ASSERT_TRUE(rough) << rough.error().reason;
  EXPECT_GT(rough->estimates.front().uncertainty.front(), 2 * exact->estimates.front().uncertainty.front());
  EXPECT_TRUE(forecast({.method = &procedure::kSwivelError, .options = {.shank = true}}, set_up));
  const auto by_head = forecast({.method = &procedure::kRotaryAxisErrors, .options = {.head = true}}, set_up);
  ASSERT_FALSE(by_head);
  EXPECT_THAT(by_head.error().reason, testing::HasSubstr("omit --head"));
}

// Scatter of runs about their mean, neither larger nor smaller than the forecast. independent: components of the value
// whose errors are independent.
void expectScatter(const LiveMethod& method, const char* key, std::size_t independent = 2) {
  SCOPED_TRACE(std::string{method.name()});
  const std::uint64_t count = runs(30);
  const auto n = static_cast<double>(count);
  const SetUp set_up;
  const auto expected = forecastOf(&method);
  const auto options = completed({.method = &method}, factsOf(set_up, 0));
  ASSERT_TRUE(options) << options.error().reason;
  std::vector<std::vector<double>> values;
  for (std::uint64_t run = 0; run < count; ++run) {
    const auto measured = simulatedRun(method, *options, set_up, 1000 + run);
    ASSERT_TRUE(measured.solved) << measured.solved.error().reason;
    values.push_back(measured.solved->find(key)->values);
  }
  metrology::Moments errors;
  for (std::size_t k = 0; k < values.front().size(); ++k) {
    double mean = 0;
    for (const auto& run : values) mean += run[k] / n;
    const double sd = sdOf(expected, key, k) * std::sqrt(1 - 1 / n);
    for (const auto& run : values) errors.add(run[k] - mean, sd);
  }
  metrology::expectHonest(errors, independent * (count - 1));
}

// The sd hold what a stop of C, of the table or of the head is off.
TEST(Forecast, OfAxesIsWhatRunsThenScatterBy) {
  expectScatter(procedure::kCentreline, "centre_mm");
  expectScatter(procedure::kCentrelineLimitedAccess, "centre_mm");
  expectScatter(procedure::kSpindleOffset2x2, "offset_C_minus_A_mm");
  expectScatter(procedure::kCAxisAlignment, "C_tilt_rad");
  expectScatter(procedure::kTablePivot, "pivot_yz_mm");
  expectScatter(procedure::kHeadPivot, "pivot_xz_mm");
}

TEST(Forecast, OfMoreAxesIsWhatRunsThenScatterBy) {
  expectScatter(procedure::kPeriodicCheck, "Xcen_B0_mm", 1);
  expectScatter(procedure::kPeriodicCheck, "Ycen_B0_mm", 1);
  expectScatter(procedure::kAAxisAlignment, "A_tilt_rad");
  expectScatter(procedure::kCAxisAlignment, "centre_mm");
}

// A machine whose head stops better than its table, and whose ball stands nearer to its axes, is forecast as it is.
TEST(Forecast, FollowsTheMachineThatIsDescribed) {
  plan::SetUp described;
  described.head.sigma_rad = 1e-6;
  described.table.sigma_rad = 2e-5;
  described.balls_mm = {{30, 0, 100}, {-15, 26, 60}, {-15, -26, 20}};
  const auto sd = [&](const LiveMethod& method, const char* key, std::size_t component, const plan::SetUp& set_up) {
    return sdOf(forecastOf(&method, {}, set_up), key, component);
  };
  EXPECT_LT(sd(procedure::kSwivelError, "error_at_queries_mm", 3, described),
            0.5 * sd(procedure::kSwivelError, "error_at_queries_mm", 3, {}));
  EXPECT_LT(sd(procedure::kHeadPivot, "pivot_xz_mm", 0, described), sd(procedure::kHeadPivot, "pivot_xz_mm", 0, {}));
  EXPECT_NEAR(sd(procedure::kSpindleOffset2x2, "offset_C_minus_A_mm", 1, described), 2e-5 * 100, 1e-4)
      << "what the table is off, at the height of the ball";
  // Balls that span less in height tell the tilt worse.
  described.table.sigma_rad = 0;
  plan::SetUp usual;
  usual.table.sigma_rad = 0;
  EXPECT_GT(sd(procedure::kCAxisAlignment, "C_tilt_rad", 0, described),
            1.2 * sd(procedure::kCAxisAlignment, "C_tilt_rad", 0, usual));
}

// A control that takes one radius all the way gives scans that tell of no delay.
TEST(Forecast, ScansWithoutStepsAreRefused) {
  const plan::SetUp set_up;
  const auto facts = factsOf(set_up, 0);
  const LiveMethod& method = procedure::kDelaySteppedScan;
  const auto plan = std::make_unique<procedure::Plan>();
  procedure::fill(*plan, method, {.reach_mm = *facts.sphereReach_mm()});
  SimulatedRecording run{set_up, facts, 1};
  for (std::size_t i = 0; i < plan->step_count; ++i) {
    auto& path = plan->steps[i].touch.scan;
    path.depths_mm[1] = path.depths_mm[0];
    path.ramp_rad = 1e-6;  // straight ways are a little deeper in their middle
    ASSERT_TRUE(run.take(plan->steps[i]));
  }
  const auto measured = procedure::runDataset(method, run.recording(), run.scales(), facts);
  const auto solved = metrology::solve(measured.dataset);
  ASSERT_FALSE(solved);
  EXPECT_EQ(solved.error().name, "constant-radius") << solved.error().reason;
}

// What is stated of the probe does not scatter from run to run.
TEST(Forecast, OfAToolIsWhatRunsThenScatterBy) {
  plan::SetUp set_up;
  set_up.sd_probe_offset_mm = 1e-9;
  Wanted tool{.method = &procedure::kToolSetter};
  tool.options.tool = 4;
  expectScatterAsForecast(tool, "tool_offset_mm", 0, 60, set_up);
}

void expectPrecise(const Wanted& wanted, std::string_view name) {
  const auto expected = forecast(wanted, {});
  ASSERT_TRUE(expected) << name << ": " << expected.error().reason;
  ASSERT_FALSE(expected->estimates.empty());
  for (const auto& estimate : expected->estimates) {
    for (std::size_t k = 0; k < estimate.sd.size(); ++k) {
      // An axis is nowhere along itself, and does not lean about itself.
      const bool none = estimate.key == "location_mm" || estimate.key == "tilt_rad";
      if (none && k == 2) continue;
      EXPECT_GT(estimate.sd[k], 0) << name << ' ' << estimate.key;
    }
  }
  EXPECT_GT(expected->duration_s, 0.5 * static_cast<double>(expected->steps));
}

TEST(Forecast, KnowsEveryMethodOfTheBoxThatMeasures) {
  for (const LiveMethod* method : procedure::liveMethods()) {
    const auto name = method->name();
    if (!method->calibrates) continue;
    Wanted wanted{.method = method};
    if (method->takes_axis) wanted.options.axis = 1;
    if (method->takes_tool) wanted.options.tool = 4;
    expectPrecise(wanted, name);
  }
}

TEST(Forecast, KnowsEveryWayToMeasure) {
  for (const LiveMethod* method : procedure::liveMethods()) {
    const auto name = method->name();
    if (!method->steps_by_head.empty()) expectPrecise({.method = method, .options = {.head = true}}, name);
    if (method->takesShank()) expectPrecise({.method = method, .options = {.shank = true}}, name);
  }
}

TEST(Forecast, OfAScrewGainsByItsTurns) {
  Wanted wanted{.method = &procedure::kScrewCalibration};
  EXPECT_EQ(forecast(wanted, {}).error().name, "bad-option") << "which screw?";
  wanted.options.axis = 3;
  wanted.options.turns = 4;
  const double four = sdOf(*forecast(wanted, {}), "drift_um_s");
  wanted.options.turns = 16;
  EXPECT_LT(sdOf(*forecast(wanted, {}), "drift_um_s"), four / 4) << "a slope gains by the cube of the time";
  EXPECT_EQ(forecast({.method = &procedure::kCentreline, .options = {.turns = 4}}, {}).error().name, "bad-option");
}

TEST(Forecast, OfAColdScrewIsAsGoodAsItsFaceTable) {
  const Wanted wanted{.method = &procedure::kScrewReference, .options = {.axis = 1}};
  plan::SetUp exact;
  exact.sd_screw_sector_um = 1e-6;
  EXPECT_NEAR(sdOf(*forecast(wanted, exact), "reference_um"), 0.02 / std::sqrt(1200.0), 1e-4);
  plan::SetUp rough;
  rough.sd_screw_sector_um = 0.2;
  EXPECT_GT(sdOf(*forecast(wanted, rough), "reference_um"), 0.15);
  EXPECT_EQ(forecast({.method = &procedure::kScrewReference, .options = {.axis = 1, .turns = 4}}, {}).error().name,
            "bad-option");
}

TEST(Forecast, GrowsWithTheNoise) {
  const auto options = atSpeeds({10, 40});
  const double usual = sdOf(forecastOf(&procedure::kDelayMultiSpeed, options), "tau_s");
  for (const double factor : {0.5, 2.0, 4.0, 8.0}) {
    plan::SetUp noisy;
    noisy.machine_noise_um *= factor;
    noisy.probe_noise_um *= factor;
    EXPECT_NEAR(sdOf(forecastOf(&procedure::kDelayMultiSpeed, options, noisy), "tau_s") / usual, factor, 0.15 * factor);
  }
}

TEST(Forecast, SaysWhichMethodsItKnowsNothingOf) {
  EXPECT_EQ(forecast({.method = &procedure::kSelftest}, {}).error().name, "not-forecast");
  EXPECT_EQ(proposals({.method = &procedure::kSelftest}, {}, 60).error().name, "not-forecast")
      << "more time would not help";
}

TEST(Forecast, OfRepeatsFallsWithTheirRoot) {
  const double once = sdOf(forecastOf(&procedure::kDelayMultiSpeed, atSpeeds({10, 40})), "tau_s");
  const double four =
      sdOf(forecastOf(&procedure::kDelayMultiSpeed, atSpeeds({10, 40, 10, 40, 10, 40, 10, 40})), "tau_s");
  EXPECT_NEAR(once / four, 2, 0.3);
}

TEST(Forecast, RefusesWhatARunWouldBeRefusedFor) {
  EXPECT_EQ(forecast({.method = &procedure::kDelayMultiSpeed, .options = atSpeeds({20})}, {}).error().name,
            "single-speed");
  EXPECT_EQ(forecast({.method = &procedure::kDelayMultiSpeed, .options = atSpeeds({0.01, 40})}, {}).error().name,
            "bad-option");
  plan::SetUp sluggish;
  sluggish.acceleration_mm_s2 = 200;
  EXPECT_FALSE(forecast({.method = &procedure::kDelayKnownSphere, .options = atSpeeds({60})}, sluggish))
      << "its speed is never constant";
}

// Its touches, scans and sweeps last for ever.
TEST(Forecast, EndsWhereTheRecordingIsFull) {
  plan::SetUp still;
  still.acceleration_mm_s2 = 1e-300;
  const std::array wanted{Wanted{.method = &procedure::kDelayMultiSpeed}, Wanted{.method = &procedure::kDelayContour},
                          Wanted{.method = &procedure::kScrewCalibration, .options = {.axis = 3}}};
  for (const auto& one : wanted) {
    const auto refused = forecast(one, still);
    ASSERT_FALSE(refused) << one.method->name();
    EXPECT_EQ(refused.error().name, "recording-full") << one.method->name();
  }
  EXPECT_THAT(forecast({.method = &procedure::kDelayMultiSpeed}, still).error().reason,
              testing::HasSubstr("--acceleration"));
}

TEST(Forecast, OfContactsIsOfMethodsThatTakeThem) {
  ProcedureOptions contacts;
  contacts.contacts = true;
  const auto refused = forecast({.method = &procedure::kDelayMultiSpeed, .options = contacts}, {});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().name, "bad-option");
  EXPECT_THAT(refused.error().reason, testing::HasSubstr("delay-multi-speed"));
}

TEST(Forecast, KnowsTheAnglesAndTheAxisOfErrorMotions) {
  const auto expected = forecastOf(&procedure::kRotaryAxisErrors);
  EXPECT_EQ(expected.axis, "C");
  const auto angles = std::ranges::find(expected.also, "angle_rad", &metrology::Estimate::key);
  ASSERT_NE(angles, expected.also.end());
  EXPECT_EQ(6 * angles->values.size(), expected.estimates.front().values.size());
}

}  // namespace
}  // namespace probebox::plan
