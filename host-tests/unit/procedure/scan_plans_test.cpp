#include <cmath>
#include <gtest/gtest.h>
#include <memory>
#include <set>
#include <string>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "firmware/procedure/plan/prompts.hpp"
#include "firmware/procedure/plan/readiness.hpp"

// Plans of scans around the datum sphere.
namespace probebox::procedure {
namespace {

constexpr double kReach_mm = 15.5;

class ScanPlan : public testing::TestWithParam<const LiveMethod*> {
 protected:
  std::unique_ptr<Plan> planned(ProcedureOptions options = {}) {
    options.reach_mm = kReach_mm;
    EXPECT_FALSE(validate(*GetParam(), options, 1.0));
    auto plan = std::make_unique<Plan>();
    fill(*plan, *GetParam(), options);
    return plan;
  }
  std::string refusal(ProcedureOptions options, double reach_mm = kReach_mm) {
    options.reach_mm = reach_mm;
    const auto error = validate(*GetParam(), options, 1.0);
    return error ? error->what : "";
  }
};

TEST_P(ScanPlan, HasOneScanInEitherSenseAtEverySpeed) {
  const auto plan = planned({.speed_count = 2, .speeds_mm_s = {10, 30}});
  ASSERT_EQ(plan->step_count, 4U);
  std::set<std::pair<double, double>> seen;
  for (std::size_t i = 0; i < plan->step_count; ++i) {
    const Step& step = plan->steps[i];
    EXPECT_EQ(step.kind, Kind::scan);
    EXPECT_EQ(step.feature, Feature::datum_sphere);
    seen.insert({step.touch.retract_speed_mm_s, step.touch.scan.sense});
  }
  EXPECT_EQ(seen, (std::set<std::pair<double, double>>{{10, 1}, {10, -1}, {30, 1}, {30, -1}}));
}

// A path that repeats itself would let a delay take one step for another.
TEST_P(ScanPlan, RepeatsNoArcAndEndsWhereItsWaysSay) {
  const auto plan = planned();
  const ScanPath& path = plan->steps[0].touch.scan;
  std::set<double> lengths;
  double all_rad = 0;
  for (std::size_t i = 0; i < path.count; ++i) {
    EXPECT_GT(path.arcs_rad[i], 0);
    lengths.insert(std::round(1e6 * path.arcs_rad[i]));
    all_rad += path.arcs_rad[i];
  }
  EXPECT_EQ(lengths.size(), path.count);
  if (!path.chords) all_rad += static_cast<double>(path.count - 1) * path.ramp_rad;
  EXPECT_NEAR(turnOf(path), path.sense * all_rad, 1e-12);
  EXPECT_LE(all_rad, kTurn_rad);
}

// Wherever the stylus is led, it is between the two depths.
TEST_P(ScanPlan, IsNowhereDeeperThanTheOvertravelAndNowhereOffTheSurface) {
  for (const double deep_mm : {0.5, 0.6, 1.0}) {
    const auto plan = planned({.overtravel_mm = deep_mm});
    const ScanPath& path = plan->steps[1].touch.scan;
    double angle_rad = path.start_rad, from_mm = kReach_mm - path.depths_mm[0], deepest_mm = 0;
    for (std::size_t i = 0; i < waysOf(path); ++i) {
      const ScanWay way = wayOf(path, i);
      const double to_mm = kReach_mm - way.to_depth_mm, next_rad = angle_rad + way.turn_rad;
      for (double share = 0; share <= 1; share += 0.01) {
        const double x = from_mm * std::cos(angle_rad) * (1 - share) + to_mm * std::cos(next_rad) * share;
        const double y = from_mm * std::sin(angle_rad) * (1 - share) + to_mm * std::sin(next_rad) * share;
        const double depth_mm = way.is_arc ? way.to_depth_mm : kReach_mm - std::hypot(x, y);
        EXPECT_GE(depth_mm, 0.5 * deep_mm - 1e-9);
        EXPECT_LE(depth_mm, deep_mm + 0.01);
        deepest_mm = std::max(deepest_mm, depth_mm);
      }
      angle_rad = next_rad, from_mm = to_mm;
    }
    EXPECT_NEAR(deepest_mm, deep_mm, 0.01);
  }
}

TEST_P(ScanPlan, RefusesWhatWouldLoseTheContactOrFeelNoSphere) {
  EXPECT_NE(refusal({.overtravel_mm = 0.3}), "") << "the middle may be off by 0.2 mm";
  EXPECT_NE(refusal({.overtravel_mm = 1.2}), "") << "beyond the probe's limit";
  EXPECT_NE(refusal({.speed_count = 1, .speeds_mm_s = {1}}), "");
  EXPECT_NE(refusal({.angles = 4}), "");
  EXPECT_NE(refusal({}, 0).find("diameter_mm"), std::string::npos);
}

TEST_P(ScanPlan, NeedsTheSizeOfTheSphereAndAProbeWithSamples) {
  Facts facts;
  const auto unready = whyUnready(*GetParam(), facts, false, ReadBy::tip);
  ASSERT_TRUE(unready);
  EXPECT_NE(unready->what.find("[datum_sphere] diameter_mm"), std::string::npos) << unready->what;
  facts.sphere_diameter_mm = 25;
  facts.stylus_ball_diameter_mm = 6;
  EXPECT_FALSE(whyUnready(*GetParam(), facts, false, ReadBy::tip)) << "no delay has to be in force";
  const auto options = described(*GetParam(), {}, facts, ReadBy::tip);
  ASSERT_TRUE(options);
  EXPECT_EQ(options->reach_mm, kReach_mm);
  facts.trigger_probe = TriggerProbe{.repeatability_mm = 0.0005};
  const auto trigger = whyUnready(*GetParam(), facts, false, ReadBy::tip);
  ASSERT_TRUE(trigger);
  EXPECT_NE(trigger->what.find("touch-trigger probe"), std::string::npos) << trigger->what;
}

TEST_P(ScanPlan, TellsAPersonAllOfIt) {
  const auto plan = planned();
  const std::string prompt = promptFor(*plan, 1);
  EXPECT_EQ(prompt.rfind("scan 2 of 6: ", 0), 0U) << prompt;
  for (const char* part : {"0.3 mm deep", "20 mm/s", "clockwise", "in contact", "exact stop"})
    EXPECT_NE(prompt.find(part), std::string::npos) << part << " is not in: " << prompt;
}

INSTANTIATE_TEST_SUITE_P(Methods, ScanPlan, testing::Values(&kDelaySteppedScan, &kDelayContour),
                         [](const auto& of_one) {
                           std::string name{of_one.param->name()};
                           std::erase(name, '-');
                           return name;
                         });

}  // namespace
}  // namespace probebox::procedure
