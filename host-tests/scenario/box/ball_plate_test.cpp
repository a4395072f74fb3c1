#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>

#include "firmware/app/results/result_events.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "measured.hpp"
#include "plate_truth.hpp"
#include "pulls.hpp"

// The errors of the rotary axis C from balls that it carries, run on the emulated machine.
namespace probebox::scenario {
namespace {

using Eigen::Vector3d;
using procedure::LiveMethod;

const ProcedureOptions kFiveAngles{.angles = 5};

TEST(LiveBallPlate, TellsTheErrorsOfTheAxisAtEveryAngle) {
  Pulls translations, rotations;
  for (std::uint64_t seed = 1; seed <= runs(8); ++seed) {
    const auto config = turningWorld(seed);
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kRotaryAxisErrors, kFiveAngles);
    ASSERT_TRUE(result);
    EXPECT_EQ(scenario.machine().stylus().contactCount(), 6U * kBalls * 5U);
    const auto& six = *result->find("six_errors");
    ASSERT_EQ(six.values.size(), 30U);
    for (std::size_t stop = 0; stop < 5; ++stop) {
      const auto truth = trueErrors(config, scenario.machine(), 2 * std::numbers::pi / 5 * static_cast<double>(stop));
      for (std::size_t e = 0; e < 6; ++e) {
        EXPECT_LT(six.sd[6 * stop + e], e < 3 ? 2e-3 : 5e-5);
        (e < 3 ? translations : rotations).add(six.values[6 * stop + e], truth[e], six.sd[6 * stop + e]);
      }
    }
    if (seed == 1) expectTheSameFrom(scenario.dataset(), *result);
  }
  translations.expectHonest();
  rotations.expectHonest();
}

TEST(LiveBallPlate, FindsWhereTheAxisIs) {
  Pulls pulls;
  for (std::uint64_t seed = 11; seed <= 10 + runs(6); ++seed) {
    const auto config = usualWorld();
    Scenario scenario{config, seed};
    const auto result = measured(scenario, procedure::kRotaryAxisErrors, kFiveAngles);
    ASSERT_TRUE(result);
    const auto& spindle = config.part_spindle;
    const auto direction = vector(world::unit(spindle.direction));
    const Vector3d point = shown(config, spindle.point_mm) - Vector3d{330, 200, -300};
    add(pulls, *result, "location_mm", {point.x(), point.y()}, 1e-3);
    add(pulls, *result, "tilt_rad", {-direction.y(), direction.x()}, 1e-5);
    EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "rotary-c");
  }
  pulls.expectHonest(Pulls::kCautious);
}

TEST(LiveBallPlate, CountsAnglesFromWhereItReadThePlate) {
  Scenario scenario{usualWorld(), 3};
  ASSERT_TRUE(measured(scenario, procedure::kRotaryAxisErrors, {.angles = 4}));
  const auto& dataset = scenario.dataset();
  EXPECT_EQ(dataset.table("second")->rows(), kBalls);
  EXPECT_EQ(dataset.table("first")->rows(), 4 * kBalls);
  const auto& phi = *dataset.table("first")->column("phi_rad");
  for (std::size_t row = 0; row < phi.size(); ++row)
    EXPECT_NEAR(phi[row], std::numbers::pi / 2 * static_cast<double>(row / kBalls), 1e-9);
}

}  // namespace
}  // namespace probebox::scenario
