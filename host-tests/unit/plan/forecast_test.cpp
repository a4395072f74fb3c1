// What is promised before measuring, against what many measurements then do.
#include "tools/plan/forecast.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <memory>

#include "firmware/procedure/plan/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "tools/plan/simulated_run.hpp"

namespace probebox::plan {
namespace {

using procedure::Method;

double sdOf(const Forecast& forecast, std::string_view key, std::size_t component = 0) {
  for (const auto& estimate : forecast.estimates) {
    if (estimate.key == key) return estimate.sd.at(component);
  }
  ADD_FAILURE() << "no " << key;
  return 0;
}

Forecast forecastOf(Method method, const ProcedureOptions& options = {}, const SetUp& set_up = {}) {
  auto expected = forecast(method, options, set_up);
  EXPECT_TRUE(expected) << expected.error().reason;
  return expected ? *expected : Forecast{};
}

ProcedureOptions atSpeeds(std::initializer_list<double> speeds_mm_s) {
  ProcedureOptions options;
  options.speed_count = static_cast<std::uint8_t>(speeds_mm_s.size());
  std::ranges::copy(speeds_mm_s, options.speeds_mm_s.begin());
  return options;
}

// Root mean square of the errors over its forecast, of runs that the forecast has not seen.
double errorsOverForecast(Method method, const char* key, double truth, std::uint64_t runs) {
  const auto steps = std::make_unique<procedure::Plan>();
  procedure::fill(*steps, method, {});
  const double sd = sdOf(forecastOf(method), key);
  double squares = 0;
  for (std::uint64_t run = 0; run < runs; ++run) {
    const auto measured = simulatedRun(*steps, plan::SetUp{}, 1000 + run);
    EXPECT_TRUE(measured.solved) << measured.solved.error().reason;
    squares += std::pow((measured.solved->find(key)->values.front() - truth) / sd, 2);
  }
  return std::sqrt(squares / static_cast<double>(runs));
}

TEST(Forecast, IsWhatRunsThenScatterBy) {
  const plan::SetUp set_up;
  // Of 60 runs the root mean square scatters by 9 %.
  EXPECT_NEAR(errorsOverForecast(Method::delay_multi_speed, "tau_s", set_up.delay_s, 60), 1, 0.3);
  EXPECT_NEAR(errorsOverForecast(Method::delay_plates, "tau_s", set_up.delay_s, 60), 1, 0.3);
  EXPECT_NEAR(errorsOverForecast(Method::delay_in_out, "tau_s", set_up.delay_s, 60), 1, 0.3);
}

TEST(Forecast, KnowsEveryMethodOfTheBoxThatMeasures) {
  for (const auto name : procedure::methodNames()) {
    const auto method = *procedure::methodNamed(name);
    ProcedureOptions options = method == Method::screw_calibration ? atSpeeds({5}) : ProcedureOptions{};
    if (method == Method::screw_calibration) options.axis = 1, options.travel_mm = 30;
    const auto expected = forecast(method, options, {});
    if (!expected && expected.error().name == "not-forecast") continue;
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
    EXPECT_GT(expected->duration_s, 0.5 * static_cast<double>(expected->touches));
  }
}

TEST(Forecast, GrowsWithTheNoise) {
  const auto options = atSpeeds({10, 40});
  const double usual = sdOf(forecastOf(Method::delay_multi_speed, options), "tau_s");
  for (const double factor : {0.5, 2.0, 4.0, 8.0}) {
    plan::SetUp noisy;
    noisy.machine_noise_um *= factor;
    noisy.probe_noise_um *= factor;
    EXPECT_NEAR(sdOf(forecastOf(Method::delay_multi_speed, options, noisy), "tau_s") / usual, factor, 0.15 * factor);
  }
}

TEST(Forecast, SaysWhichMethodsItKnowsNothingOf) {
  for (const auto method : {Method::selftest, Method::screw_calibration, Method::centreline_by_steps}) {
    EXPECT_EQ(forecast(method, {}, {}).error().name, "not-forecast");
    EXPECT_EQ(proposals(method, {}, {}, 60).error().name, "not-forecast") << "more time would not help";
  }
}

TEST(Forecast, OfRepeatsFallsWithTheirRoot) {
  const double once = sdOf(forecastOf(Method::delay_multi_speed, atSpeeds({10, 40})), "tau_s");
  const double four = sdOf(forecastOf(Method::delay_multi_speed, atSpeeds({10, 40, 10, 40, 10, 40, 10, 40})), "tau_s");
  EXPECT_NEAR(once / four, 2, 0.3);
}

TEST(Forecast, RefusesWhatARunWouldBeRefusedFor) {
  EXPECT_EQ(forecast(Method::delay_multi_speed, atSpeeds({20}), {}).error().name, "single-speed");
  EXPECT_EQ(forecast(Method::delay_multi_speed, atSpeeds({0.01, 40}), {}).error().name, "bad-option");
  plan::SetUp sluggish;
  sluggish.acceleration_mm_s2 = 200;
  EXPECT_FALSE(forecast(Method::delay_known_sphere, atSpeeds({60}), sluggish)) << "its speed is never constant";
}

TEST(Proposals, SayWhatIsWrongWhereNoTimeWouldHelp) {
  const auto refused = proposals(Method::delay_multi_speed, {.overtravel_mm = 500}, {}, 60);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().name, "bad-option");
  EXPECT_NE(refused.error().reason.find("An overtravel of 500 mm"), std::string::npos);
}

TEST(Proposals, FitIntoTheTimeAndTheBestComesFirst) {
  for (const auto method : {Method::delay_multi_speed, Method::delay_known_sphere, Method::centreline}) {
    const auto answered = proposals(method, {}, {}, 60);
    ASSERT_TRUE(answered);
    const auto& found = *answered;
    ASSERT_FALSE(found.empty());
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_LE(found[i].duration_s, 60);
      if (i == 0) continue;
      EXPECT_LE(found[i - 1].estimates.front().sd.front(), found[i].estimates.front().sd.front());
    }
    const auto own = forecastOf(method);
    if (own.duration_s > 60) continue;
    EXPECT_LT(found.front().estimates.front().sd.front(), 1.1 * own.estimates.front().sd.front());
  }
  EXPECT_TRUE(proposals(Method::centreline, {}, {}, 0.5)->empty());
}

// What somebody has chosen stays as it is.
TEST(Proposals, LeaveAloneWhatIsChosen) {
  ProcedureOptions options;
  options.angles = 5;
  const auto around_c = proposals(Method::centreline, options, {}, 1000);
  for (const auto& one : *around_c) EXPECT_EQ(one.options.angles, 5);
  const auto touches = proposals(Method::delay_multi_speed, atSpeeds({10, 30}), {}, 1000);
  for (const auto& one : *touches) EXPECT_EQ(one.options.speed_count, 2);
}

}  // namespace
}  // namespace probebox::plan
