#include <Eigen/Geometry>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <random>
#include <span>

#include "firmware/app/results/result_events.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "measured.hpp"
#include "plate_truth.hpp"
#include "pulls.hpp"

// The errors of the table's tilt B from the balls that it carries, run on the emulated machine.
namespace probebox::scenario {
namespace {

using Eigen::Vector3d;

constexpr std::array<double, 5> kTilts_deg{-90, -60, -30, 0, 20};
const Vector3d kAxisPoint{330, 200, -260};

world::Config tiltingWorld(std::uint64_t seed) {
  std::mt19937_64 random{seed};
  const auto anywhere = [&](double size) {
    std::uniform_real_distribution<double> uniform{-size, size};
    return world::Vector3{uniform(random), uniform(random), uniform(random)};
  };
  auto config = usualWorld();
  config.tilting_table->errors = {
      .cosine_mm = anywhere(0.01), .sine_mm = anywhere(0.01), .cosine_rad = anywhere(4e-5), .sine_rad = anywhere(4e-5)};
  return config;
}

std::array<double, 6> trueErrorsOfB(const world::Config& config, const world::Machine& machine, double tilt_rad) {
  const Eigen::AngleAxisd turn{tilt_rad, Vector3d::UnitX()};
  Eigen::Matrix3Xd ideal(3, kBalls), real(3, kBalls);
  for (std::size_t ball = 0; ball < kBalls; ++ball) {
    const auto k = static_cast<Eigen::Index>(ball);
    const auto at_zero = world::operator+(config.part_spindle.point_mm, config.part_spindle.balls_mm[ball]);
    ideal.col(k) = turn * (shown(config, at_zero) - kAxisPoint);
    real.col(k) = shown(config, machine.partPoint(at_zero, {.tilt_rad = tilt_rad})) - kAxisPoint;
  }
  return sixErrorsOf(motionBetween(ideal, real));
}

ProcedureOptions aboutB(Scenario& scenario, std::span<const double> tilts_deg, std::uint8_t mounts = 0) {
  auto& table = scenario.facts.tilting_table.value();
  table.count = tilts_deg.size();
  for (std::size_t i = 0; i < tilts_deg.size(); ++i) table.angles_rad[i] = tilts_deg[i] * std::numbers::pi / 180;
  const ProcedureOptions options{.balls = kBalls, .axis = procedure::kAxisB, .mounts = mounts};
  const auto ready = procedure::readied(procedure::kRotaryAxisErrors, options, scenario.facts, {});
  EXPECT_TRUE(ready) << ready.error().what;
  return *ready;
}

TEST(LivePlateOnB, TellsTheErrorsOfTheTableAtEveryTilt) {
  Pulls translations, rotations;
  for (std::uint64_t seed = 1; seed <= runs(6); ++seed) {
    const auto config = tiltingWorld(seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kRotaryAxisErrors, aboutB(scenario, kTilts_deg));
    ASSERT_TRUE(result);
    EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "rotary-b");
    const auto& six = *result->find("six_errors");
    ASSERT_EQ(six.values.size(), 6 * kTilts_deg.size());
    for (std::size_t stop = 0; stop < kTilts_deg.size(); ++stop) {
      const auto truth = trueErrorsOfB(config, scenario.machine(), kTilts_deg[stop] * std::numbers::pi / 180);
      for (std::size_t e = 0; e < 6; ++e) {
        EXPECT_LT(six.sd[6 * stop + e], e < 3 ? 3e-3 : 6e-5);
        (e < 3 ? translations : rotations).add(six.values[6 * stop + e], truth[e], six.sd[6 * stop + e]);
      }
    }
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  translations.expectHonest();
  rotations.expectHonest();
}

// Mounts 3 and 4 of an R-test: about B, and displaced along it.
TEST(LivePlateOnB, TellsTheErrorsOfTheTableFromTwoMounts) {
  constexpr std::array<double, 3> kFew_deg{-60, -30, 0};
  Pulls pulls;
  for (std::uint64_t seed = 21; seed <= 20 + runs(8); ++seed) {
    auto config = tiltingWorld(seed);
    config.part_spindle.further_mounts = {{.turn_rad = {0, 0, 0.3}, .shift_mm = {40, 0, 0}}};
    Scenario scenario{config, seed};
    scenario.facts.ball_plate.value().mount_turns_rad = {config.part_spindle.further_mounts.front().turn_rad[2]};
    const auto result = measured(scenario, procedure::kRotaryAxisErrors, aboutB(scenario, kFew_deg, 2));
    ASSERT_TRUE(result);
    const auto& six = *result->find("six_errors");
    ASSERT_EQ(six.values.size(), 6 * kFew_deg.size());
    for (std::size_t stop = 0; stop < kFew_deg.size(); ++stop) {
      const auto truth = trueErrorsOfB(config, scenario.machine(), kFew_deg[stop] * std::numbers::pi / 180);
      for (std::size_t e = 0; e < 6; ++e) pulls.add(six.values[6 * stop + e], truth[e], six.sd[6 * stop + e]);
    }
  }
  pulls.expectHonest();
}

}  // namespace
}  // namespace probebox::scenario
