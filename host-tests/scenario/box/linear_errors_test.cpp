#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/readiness.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/support/runs.hpp"
#include "measured.hpp"
#include "plate_truth.hpp"
#include "pulls.hpp"

// A ball plate on C of a machine whose linear axes have errors too: reading by stations tells them from those of C.
namespace probebox::scenario {
namespace {

using Eigen::Vector3d;

constexpr std::size_t kPlateBalls = 6;
constexpr std::size_t kStops = 3;
const ProcedureOptions kByThirds{.angles = kStops, .balls = kPlateBalls};
const Vector3d kTableAxis{330, 200, -300};

// Six balls at equal pitch and height, errors of C, and errors of X, Y and Z of some micrometres over the plate.
world::Config plateWorld(std::uint64_t seed, bool straight = false) {
  auto config = turningWorld(seed);
  auto& part = config.part_spindle;
  part.balls_mm.resize(kPlateBalls);
  for (std::size_t ball = 0; ball < kPlateBalls; ++ball) {
    const double at_rad = 2 * std::numbers::pi * static_cast<double>(ball) / kPlateBalls;
    part.balls_mm[ball] = {60 * std::cos(at_rad), 60 * std::sin(at_rad), 100};
  }
  if (straight) return config;
  std::mt19937_64 random{seed + 1000};
  std::uniform_real_distribution<double> either{-1, 1}, length_mm{70, 160}, phase{0, 6};
  auto& errors = config.linear_axes;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    errors.scale[axis] = 30e-6 * either(random);
    errors.squareness_rad[axis] = 4e-5 * either(random);
    for (auto& wave : errors.waves[axis]) wave = {0.003 * either(random), length_mm(random), phase(random)};
  }
  return config;
}

void describePlate(Scenario& scenario, const world::Config& config, bool by_stations) {
  auto& plate = *scenario.facts.ball_plate;
  plate.station_correction = by_stations;
  plate.balls_mm.assign(config.part_spindle.balls_mm.begin(), config.part_spindle.balls_mm.begin() + kPlateBalls);
}

// Every ball with the axis at zero, and so many at each angle, with a sensor head whose matrix is known.
std::optional<metrology::Solved> run(Scenario& scenario, const world::Config& config, std::uint16_t stations = 0) {
  auto& head = scenario.facts.sensor_head.value();
  const auto& tools = config.further_tools;
  const auto& tool = *std::ranges::find_if(tools, [](const auto& t) { return t.head.has_value(); });
  head.calibrated =
      procedure::CalibratedHead{.result_id = 7, .tool = head.tool, .matrix = tool.head->sensors, .sd = {}};
  head.sd_centre_offset_mm = 1e-6;  // it is where it is described
  auto options = kByThirds;
  options.stations = stations;
  options.head = true;
  const auto ready = procedure::readied(procedure::kRotaryAxisErrors, options, scenario.facts, {});
  EXPECT_TRUE(ready) << ready.error().what;
  scenario.recorder().keeps_bytes = false;
  scenario.run(std::chrono::seconds{2});
  const auto solved = scenario.calibrate(procedure::kRotaryAxisErrors, *ready);
  EXPECT_TRUE(solved);
  EXPECT_EQ(scenario.machine().crashes(), 0U);
  const std::size_t a_stop = stations > 0 ? stations : kPlateBalls;
  EXPECT_EQ(scenario.state().procedure.steps, kStops * a_stop + kPlateBalls);
  return solved;
}

// What a point reads when the head is centred on it.
Vector3d onTheScales(const Scenario& scenario, const world::Config& config, const world::Vector3& at) {
  const auto& machine = scenario.machine();
  const Vector3d hanging = vector(machine.tipIn({}, scenario.facts.sensor_head->tool));
  Vector3d error = Vector3d::Zero();
  for (int i = 0; i < 3; ++i) {
    const Vector3d position = vector(at) - hanging - error;
    const world::Vector3 now{position.x(), position.y(), position.z()};
    error = vector(machine.bodyFor(now)) - position;
  }
  return shown(config, at) - error;
}

// The six errors of C in the machine's own coordinates: what the places of the balls are off by as one body is in them.
std::array<double, 6> errorsOnTheScales(const Scenario& scenario, const world::Config& config, double phi_rad) {
  Eigen::Matrix3Xd straight(3, kPlateBalls), scales(3, kPlateBalls), turned(3, kPlateBalls);
  const auto& part = config.part_spindle;
  for (std::size_t ball = 0; ball < kPlateBalls; ++ball) {
    const auto k = static_cast<Eigen::Index>(ball);
    const auto at_zero = world::operator+(part.point_mm, part.balls_mm[ball]);
    straight.col(k) = shown(config, at_zero);
    scales.col(k) = onTheScales(scenario, config, at_zero);
    turned.col(k) = shown(config, scenario.machine().partPoint(at_zero, {.c_rad = phi_rad}));
  }
  const Eigen::Isometry3d seen = motionBetween(straight, scales);
  const Eigen::AngleAxisd turn{phi_rad, Vector3d::UnitZ()};
  const Eigen::Matrix3Xd ideal = turn.toRotationMatrix() * ((seen * straight).colwise() - kTableAxis);
  const Eigen::Matrix3Xd real = (seen * turned).colwise() - kTableAxis;
  return sixErrorsOf(motionBetween(ideal, real));
}

void addErrors(Pulls& translations, Pulls& rotations, const metrology::Result& result, const world::Config& config,
               const Scenario& scenario) {
  const auto& six = *result.find("six_errors");
  ASSERT_EQ(six.values.size(), 6 * kStops);
  for (std::size_t stop = 0; stop < kStops; ++stop) {
    const auto truth = errorsOnTheScales(scenario, config, 2 * std::numbers::pi * static_cast<double>(stop) / kStops);
    for (std::size_t e = 0; e < 6; ++e)
      (e < 3 ? translations : rotations).add(six.values[6 * stop + e], truth[e], six.sd[6 * stop + e]);
  }
}

TEST(LiveStations, TellTheErrorsOfCFromThoseOfTheLinearAxes) {
  Pulls translations, rotations, few_translations, few_rotations;
  for (std::uint64_t seed = 1; seed <= runs(12); ++seed) {
    const auto config = plateWorld(seed);
    Scenario scenario{config, seed};
    describePlate(scenario, config, true);
    const auto solved = run(scenario, config);
    ASSERT_TRUE(solved && solved->ok()) << (solved ? solved->error().reason : "did not end");
    addErrors(translations, rotations, solved->value(), config, scenario);

    // The balls at three places alone, so that the linear axes go to and fro between these.
    Scenario at_few{config, seed + 100};
    describePlate(at_few, config, false);
    const auto few = run(at_few, config, 3);
    ASSERT_TRUE(few && few->ok()) << (few ? few->error().reason : "did not end");
    EXPECT_TRUE(std::get<bool>(at_few.dataset().config.at("station_correction")));
    addErrors(few_translations, few_rotations, few->value(), config, at_few);
  }
  translations.expectHonest();
  rotations.expectHonest();
  few_translations.expectHonest();
  few_rotations.expectHonest();
}

TEST(LiveStations, AreWhatSuchAMachineNeeds) {
  const auto config = plateWorld(1);
  Scenario scenario{config, 1};
  describePlate(scenario, config, false);
  const auto solved = run(scenario, config);
  ASSERT_TRUE(solved);
  ASSERT_FALSE(solved->ok()) << "the plate does not agree with its certificate";
  EXPECT_EQ(solved->error().name, "residual-too-large");
}

// What three places say without the correction is off by more than the sd that the correction leaves.
TEST(LiveStations, TakeOutMoreThanTheyAreUncertainBy) {
  const auto config = plateWorld(1);
  Scenario scenario{config, 1};
  describePlate(scenario, config, false);
  const auto solved = run(scenario, config, 3);
  ASSERT_TRUE(solved && solved->ok());
  auto without = scenario.dataset();
  without.config.erase("station_correction");
  without.config["sigma_mm"] = without.config["sigma_axial_mm"] = 0.02;
  const auto biased = metrology::solve(without);
  ASSERT_TRUE(biased.ok()) << biased.error().reason;
  const auto &corrected = *solved->value().find("six_errors"), &plain = *biased->find("six_errors");
  double worst = 0;
  for (std::size_t stop = 1; stop < kStops; ++stop) {
    const auto truth = errorsOnTheScales(scenario, config, 2 * std::numbers::pi * static_cast<double>(stop) / kStops);
    for (std::size_t e = 0; e < 6; ++e)
      worst = std::max(worst, std::abs(plain.values[6 * stop + e] - truth[e]) / corrected.sd[6 * stop + e]);
  }
  EXPECT_GT(worst, 5);
}

TEST(LiveStations, CostNothingOnAStraightMachine) {
  const auto config = plateWorld(3, true);
  Scenario scenario{config, 3};
  describePlate(scenario, config, true);
  const auto solved = run(scenario, config);
  ASSERT_TRUE(solved && solved->ok());
  const auto& six = *solved->value().find("six_errors");
  for (std::size_t stop = 0; stop < kStops; ++stop) {
    const auto truth =
        trueErrors(config, scenario.machine(), 2 * std::numbers::pi * static_cast<double>(stop) / kStops);
    for (std::size_t e = 0; e < 6; ++e)
      EXPECT_LT(std::abs(six.values[6 * stop + e] - truth[e]), 4 * six.sd[6 * stop + e]);
  }
}

// The same plate twice, turned and lifted in between: twice as many balls at every angle.
TEST(LiveMounts, TellTheErrorsOfCFromTwoMountsOfThePlate) {
  Pulls translations, rotations;
  double sd_in_one = 0, sd_in_two = 0;
  for (std::uint64_t seed = 1; seed <= runs(6); ++seed) {
    auto config = turningWorld(seed);
    config.part_spindle.further_mounts = {{.turn_rad = {0.01, -0.02, 0.4}, .shift_mm = {3, -2, 25}}};
    Scenario scenario{config, seed};
    const auto result =
        measured(scenario, procedure::kRotaryAxisErrors, {.angles = kStops, .balls = kBalls, .mounts = 2});
    ASSERT_TRUE(result);
    EXPECT_EQ(scenario.machine().stylus().contactCount(), 2U * 5U * kBalls * (kStops + 1));
    EXPECT_EQ(scenario.machine().mount(), 2U) << "it stays where it was put";
    EXPECT_TRUE(scenario.dataset().table("first")->column("mount"));
    const auto& six = *result->find("six_errors");
    for (std::size_t stop = 0; stop < kStops; ++stop) {
      const auto truth =
          trueErrors(config, scenario.machine(), 2 * std::numbers::pi * static_cast<double>(stop) / kStops);
      for (std::size_t e = 0; e < 6; ++e)
        (e < 3 ? translations : rotations).add(six.values[6 * stop + e], truth[e], six.sd[6 * stop + e]);
    }
    if (seed > 1) continue;
    sd_in_two = six.sd[6 + 3];
    Scenario once{config, seed};
    const auto alone = measured(once, procedure::kRotaryAxisErrors, {.angles = kStops, .balls = kBalls});
    ASSERT_TRUE(alone);
    sd_in_one = alone->find("six_errors")->sd[6 + 3];
  }
  EXPECT_LT(sd_in_two, sd_in_one);
  translations.expectHonest();
  rotations.expectHonest();
}

}  // namespace
}  // namespace probebox::scenario
