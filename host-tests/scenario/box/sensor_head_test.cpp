#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <numbers>
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

// A sensor head (R-test) in the place of the probe: its own calibration, and the errors of C read with it.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using procedure::LiveMethod;
using testing::HasSubstr;

const std::uint64_t kHeadSeeds = runs(10);

board::WorldTool& headIn(world::Config& config) {
  auto& tools = config.further_tools;
  return *std::ranges::find_if(tools, [](const auto& tool) { return tool.head.has_value(); });
}

// Sensors that look elsewhere than those of the board, and a centre that is not quite where it is described.
world::Config headWorld(std::uint64_t seed, double sd_centre_mm) {
  world::Config config = turningWorld(seed);
  world::Random random{seed, 91};
  auto& tool = headIn(config);
  for (auto& sensor : tool.head->sensors)
    for (double& of_axis : sensor) of_axis += random.uniform(-0.05, 0.05);
  for (double& off : tool.offset_mm) off += sd_centre_mm * random.normal();
  tool.length_mm += sd_centre_mm * random.normal();
  return config;
}

Matrix3d matrixOf(const std::array<std::array<double, 3>, 3>& rows) {
  Matrix3d matrix;
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k) matrix(i, k) = rows[static_cast<std::size_t>(i)][static_cast<std::size_t>(k)];
  return matrix;
}

std::optional<metrology::Solved> calibrated(Scenario& scenario) {
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  const auto method = procedure::kSensorHeadCalibration;
  const auto solved = scenario.calibrate(method, procedure::described(method, {}, scenario.facts).value());
  EXPECT_TRUE(solved && solved->ok()) << (solved ? solved->error().reason : "did not end");
  EXPECT_EQ(scenario.machine().crashes(), 0U);
  EXPECT_EQ(scenario.machine().stylus().contactCount(), 0U) << "nothing is touched";
  return solved;
}

// Accepted, as the box would take it from its store.
procedure::CalibratedHead accepted(const Scenario& scenario, const metrology::Result& result) {
  store::Record record{};
  record.id = 41;
  record.binding.subject = metrology::subjectOf(scenario.dataset());
  record.content = result;
  EXPECT_EQ(record.binding.subject, "sensor-head-5");
  EXPECT_TRUE(app::activationOf(record, {})->empty()) << "the core does not use it";
  return app::calibratedHeadOf(record).value();
}

std::optional<metrology::Solved> readByHead(Scenario& scenario, ProcedureOptions options = {.angles = 5}) {
  const auto method = procedure::kRotaryAxisErrors;
  return scenario.calibrate(method,
                            procedure::described(method, options, scenario.facts, procedure::ReadBy::head).value());
}

TEST(LiveSensorHead, FindsItsSensorsAsWellAsItSays) {
  Pulls entries, places;
  for (std::uint64_t seed = 1; seed <= kHeadSeeds; ++seed) {
    auto config = headWorld(seed, 0);
    Scenario scenario{config, seed};
    const auto solved = calibrated(scenario);
    ASSERT_TRUE(solved && solved->ok());
    const auto& sensors = headIn(config).head->sensors;
    std::vector<double> truth;
    for (const auto& sensor : sensors) truth.insert(truth.end(), sensor.begin(), sensor.end());
    add(entries, solved->value(), "sensor_matrix", truth, 1e-3);
    EXPECT_EQ(solved->value().dof, 27U) << "13 holds of three sensors, and 12 unknowns";
    EXPECT_TRUE(solved->value().warnings.empty()) << solved->value().warnings.front();

    // What K^-1 makes of the sensors, for a ball that is somewhere in the head.
    const auto head = accepted(scenario, solved->value());
    const Matrix3d inverse = matrixOf(head.matrix).inverse(), sd = matrixOf(head.sd);
    world::Random random{seed, 92};
    const Vector3d u{random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2), random.uniform(-0.2, 0.2)};
    const Vector3d found = inverse * (matrixOf(sensors) * u);
    const Vector3d variance = inverse.cwiseAbs2() * (sd.cwiseAbs2() * u.cwiseAbs2());
    for (int i = 0; i < 3; ++i) places.add(found[i], u[i], std::sqrt(variance[i]));
  }
  entries.expectHonest();
  places.expectHonest();
}

TEST(LiveSensorHead, TellsWhereItsCentreIsOnTheSphere) {
  Pulls centred;
  for (std::uint64_t seed = 1; seed <= runs(24); ++seed) {
    auto config = headWorld(seed, 0.02);
    config.swivel_head->noise_rad = 0;  // it says where the centre is at this stop of the head
    Scenario scenario{config, seed};
    const auto solved = calibrated(scenario);
    ASSERT_TRUE(solved && solved->ok());
    const auto& tool = headIn(config);
    const auto& centre = config.sphere.centre_mm;
    add(centred, solved->value(), "centred_mm",
        {centre[0] - tool.offset_mm[0], centre[1] - tool.offset_mm[1],
         centre[2] + tool.length_mm - config.probe_spindle.stylus_length_mm},
        1e-3);
  }
  centred.expectHonest();
}

TEST(LiveSensorHead, IsSavedWithEveryDigitAndEveryHold) {
  Scenario scenario{headWorld(1, 0), 1};
  const auto solved = calibrated(scenario);
  ASSERT_TRUE(solved && solved->ok());
  const auto& dataset = scenario.dataset();
  EXPECT_EQ(metrology::subjectOf(dataset), "sensor-head-5");
  EXPECT_EQ(dataset.table("moves")->rows(), 13U);
  EXPECT_EQ(dataset.table("holds")->rows(), 13U);
  EXPECT_GT(dataset.table("probe")->rows(), 13U * 100U);
  expectTheSameFrom(dataset, solved->value());
}

TEST(LiveSensorHead, AsksAgainForABallThatIsBeyondItsSensors) {
  auto config = headWorld(2, 0);
  config.sphere.centre_mm[0] += 1.2;
  Scenario scenario{config, 2};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  const auto method = procedure::kSensorHeadCalibration;
  scenario.start(method, procedure::described(method, {}, scenario.facts).value());
  ASSERT_TRUE(scenario.runUntil([&] { return scenario.state().procedure.state == procedure::State::refused; }, 60s));
  EXPECT_EQ(scenario.state().procedure.last_fault, capture::TouchFault::head_out_of_range);
}

TEST(LiveBallPlateByHead, TellsTheErrorsOfTheAxisAtEveryAngle) {
  Pulls translations, rotations;
  for (std::uint64_t seed = 1; seed <= kHeadSeeds; ++seed) {
    const auto config = headWorld(seed, 0);
    Scenario scenario{config, seed};
    scenario.facts.sensor_head->sd_centre_offset_mm = 0;
    const auto head = calibrated(scenario);
    ASSERT_TRUE(head && head->ok());
    scenario.facts.sensor_head->calibrated = accepted(scenario, head->value());
    const auto solved = readByHead(scenario);
    ASSERT_TRUE(solved && solved->ok()) << (solved ? solved->error().reason : "did not end");
    const auto& result = solved->value();
    EXPECT_EQ(scenario.machine().crashes(), 0U);
    EXPECT_EQ(scenario.machine().stylus().contactCount(), 0U);
    EXPECT_EQ(scenario.state().procedure.steps, 6U * kBalls) << "one hold a ball and stop";
    EXPECT_TRUE(result.warnings.empty()) << result.warnings.front();
    const auto& six = *result.find("six_errors");
    ASSERT_EQ(six.values.size(), 30U);
    for (std::size_t stop = 0; stop < 5; ++stop) {
      const auto truth = trueErrors(config, scenario.machine(), 2 * std::numbers::pi / 5 * static_cast<double>(stop));
      for (std::size_t e = 0; e < 6; ++e) {
        EXPECT_LT(six.sd[6 * stop + e], e < 3 ? 5e-4 : 2e-5);
        (e < 3 ? translations : rotations).add(six.values[6 * stop + e], truth[e], six.sd[6 * stop + e]);
      }
    }
    EXPECT_EQ(metrology::subjectOf(scenario.dataset()), "rotary-c");
    if (seed == 1) expectTheSameFrom(scenario.dataset(), result);
  }
  translations.expectHonest();
  rotations.expectHonest();
}

// The whole chain: where the axis is depends on where the head's centre is, which is stated with an sd.
TEST(LiveBallPlateByHead, FindsWhereTheAxisIsAsFarAsTheHeadsCentreIsKnown) {
  Pulls places, tilts;
  for (std::uint64_t seed = 1; seed <= kHeadSeeds; ++seed) {
    const double sd_mm = usualFacts().sensor_head->sd_centre_offset_mm;
    auto config = headWorld(seed, sd_mm);
    config.part_spindle.errors = {};
    Scenario scenario{config, seed};
    const auto head = calibrated(scenario);
    ASSERT_TRUE(head && head->ok());
    scenario.facts.sensor_head->calibrated = accepted(scenario, head->value());
    const auto solved = readByHead(scenario, {.angles = 4});
    ASSERT_TRUE(solved && solved->ok()) << (solved ? solved->error().reason : "did not end");
    const Vector3d point = shown(config, config.part_spindle.point_mm) - Vector3d{330, 200, -300};
    add(places, solved->value(), "location_mm", {point.x(), point.y()}, 2 * sd_mm);
    const auto direction = vector(world::unit(config.part_spindle.direction));
    add(tilts, solved->value(), "tilt_rad", {-direction.y(), direction.x()}, 1e-5);
  }
  places.expectHonest();
  tilts.expectHonest();
}

TEST(LiveBallPlateByHead, NeedsTheHeadsCalibration) {
  Scenario scenario{usualWorld(), 3};
  scenario.recorder().keeps_bytes = false;
  scenario.run(2s);
  EXPECT_THAT(procedure::whyNoHead(procedure::kRotaryAxisErrors, scenario.facts)->what,
              HasSubstr("calibrate sensor-head-calibration"));
  const auto solved = readByHead(scenario, {.angles = 4});
  ASSERT_TRUE(solved && !solved->ok()) << "its calibration may have been rolled back meanwhile";
  EXPECT_EQ(solved->error().name, "no-sensor-head");
  EXPECT_EQ(scenario.dataset().table("holds")->rows(), 5 * kBalls) << "the holds are there nevertheless";
}

TEST(LiveBallPlateByHead, LeavesTheProbeToTheMethodThatComesAfter) {
  Scenario scenario{usualWorld(), 7};
  ASSERT_TRUE(calibrated(scenario));
  ASSERT_EQ(scenario.machine().tool(), 5U);
  const auto solved = scenario.calibrate(procedure::kDelayKnownSphere);
  ASSERT_TRUE(solved && solved->ok());
  EXPECT_EQ(scenario.machine().tool(), 1U);
  EXPECT_LT(std::abs(solved->value().find("tau_s")->values[0] - scenario.truth().tau_s[0]),
            5 * solved->value().find("tau_s")->sd[0]);
}

}  // namespace
}  // namespace probebox::scenario
