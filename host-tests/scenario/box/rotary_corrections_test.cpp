#include <cmath>
#include <gtest/gtest.h>
#include <random>

#include "firmware/app/results/result_events.hpp"
#include "firmware/metrology/methods.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "host-tests/emulation/scenario.hpp"
#include "host-tests/metrology/exact_machine.hpp"
#include "host-tests/support/runs.hpp"
#include "protocol/units/angle.hpp"
#include "pulls.hpp"
#include "watched_twin.hpp"

// The table of the emulated machine turns with errors: a plate of balls is read on it, the result comes into force, and
// what the CNC then reads is what the table's points are really off by.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using published::Health;
using world::FaultKind;
using world::Vector3;
using world::operator+;
using world::operator-;
using world::operator*;

constexpr int kAngles = 12;
constexpr std::size_t kTableBalls = 8;
constexpr double kSigma_mm = 0.0005;
constexpr auto kRotary = static_cast<std::size_t>(SourceKind::rotary);

world::Config turningTableWorld() {
  auto config = usualWorld();
  config.part_spindle.direction = {5e-5, -8e-5, 1};
  config.part_spindle.errors = {.cosine_mm = {0.006, -0.004, 0.002},
                                .sine_mm = {0.003, 0.008, -0.001},
                                .cosine_rad = {2e-5, 3e-5, 0},
                                .sine_rad = {-3e-5, 1e-5, 2e-5}};
  config.rotary.noise_rad = 0;  // where C stops is not in the errors of its axis
  return config;
}

class TurningTable : public testing::Test {
 protected:
  explicit TurningTable(const world::Config& world = turningTableWorld(), std::uint64_t seed = 1)
      : config{world}, scenario{world, seed}, random{static_cast<unsigned>(seed)} {
    scenario.recorder().keeps_bytes = false;
    // Where the machine's builder says that the axis is, and along Z.
    nominal_mm = config.part_spindle.point_mm + Vector3{0.02, -0.03, 0};
  }

  Vector3 read(const Vector3& point) {
    std::normal_distribution<double> noise{0, kSigma_mm};
    return point + Vector3{noise(random), noise(random), noise(random)};
  }
  // What an R-test sees of a ball plate around the axis.
  metrology::Dataset plateReadings() {
    constexpr std::array<std::string_view, 5> kFirst{"phi_rad", "ball", "x_mm", "y_mm", "z_mm"};
    auto first = metrology::Table::withColumns("first", kFirst);
    auto second = metrology::Table::withColumns("second", std::span{kFirst}.last(4));
    auto third = metrology::Table::withColumns("third", std::span{kFirst}.last(4));
    for (std::size_t i = 0; i < kTableBalls; ++i) {
      const double at = kTurn * static_cast<double>(i) / kTableBalls;
      const auto ball = static_cast<double>(i + 1);
      const Vector3 own{120 * std::cos(at), 120 * std::sin(at), i % 2 == 0 ? -10.0 : 10.0};
      const auto& machine = scenario.machine();
      const Vector3 zero = read(machine.partPoint(nominal_mm + own, {}));
      second.append({ball, zero[0], zero[1], zero[2]});
      third.append({ball, own[0], own[1], own[2]});
      for (int k = 0; k < kAngles; ++k) {
        const double phi = kTurn * k / kAngles;
        const Vector3 turned = read(machine.partPoint(nominal_mm + own, {.c_rad = phi}));
        first.append({phi, ball, turned[0], turned[1], turned[2]});
      }
    }
    metrology::Dataset dataset{.method = "rotary-axis-errors",
                               .config = {{"axis", std::string{"C"}},
                                          {"axis_point_mm", std::vector<double>{nominal_mm.begin(), nominal_mm.end()}},
                                          {"axis_direction", std::vector<double>{0, 0, 1}},
                                          {"sigma_mm", kSigma_mm}},
                               .tables = {std::move(first), std::move(second), std::move(third)}};
    metrology::stateExactMachine(dataset);
    return dataset;
  }
  // Accepted, as the box would take it from its store.
  void activate() {
    const auto dataset = plateReadings();
    const auto solved = metrology::solve(dataset);
    ASSERT_TRUE(solved) << solved.error().reason;
    store::Record record{};
    record.id = 31;
    record.binding.subject = metrology::subjectOf(dataset);
    record.content = *solved;
    const auto events = app::activationOf(record, scenario.now());
    ASSERT_TRUE(events && events->size() == kAngles + 1);
    ASSERT_FALSE(box::validateActivation(usualBox(config), *events));
    for (const auto& event : *events) scenario.push(event);
    scenario.push(SourcesEnabled{.mask = bitOf(SourceKind::rotary), .at = scenario.now()});
  }
  void turnTo(double c_rad) {
    ASSERT_TRUE(scenario.world().machine().turnTo({.c_rad = c_rad}, scenario.now()));
    scenario.run(4s);
    ASSERT_TRUE(scenario.machine().atRest(scenario.now()));
  }
  // How far the point of the table that should be under the tool really is from there.
  Vector3 truth() {
    const Vector3 tool = scenario.machine().positionAt(scenario.now());
    const double c_rad = scenario.machine().partAngleAt(scenario.now());
    const Vector3 at_zero = nominal_mm + world::rotation({0, 0, 1}, -c_rad) * (tool - nominal_mm);
    return scenario.machine().partPoint(at_zero, {.c_rad = c_rad}) - tool;
  }
  // The result's sd where the tool is now (k = 1): of the translations, and of the rotations by their levers.
  Vector3 statedSd() {
    const auto& sd = served().rotary[2].sd_errors;
    const Vector3 lever = scenario.machine().positionAt(scenario.now()) - nominal_mm;
    Vector3 all{};
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
      all[i] = std::hypot(sd[i], sd[3 + j] * lever[k], sd[3 + k] * lever[j]);
    }
    return all;
  }
  const published::Snapshot& served() const { return scenario.state().snapshot; }

  world::Config config;
  Scenario scenario;
  std::mt19937 random;
  Vector3 nominal_mm{};
};

TEST_F(TurningTable, IsCorrectedAtEveryAngleWithinWhatTheResultStates) {
  scenario.run(2s);
  activate();
  double largest_mm = 0;
  for (const double degrees : {0.0, 30.0, 77.0, 150.0, 201.0, 345.0, 400.0}) {
    turnTo(degrees * kTurn / 360);
    ASSERT_TRUE(served().valid) << degrees;
    EXPECT_TRUE(served().settled);
    EXPECT_NEAR(served().rotary[2].angle_rad, degrees * kTurn / 360, 1e-6);
    const auto off = truth(), sd = statedSd();
    for (std::size_t axis = 0; axis < 3; ++axis) {
      EXPECT_LT(sd[axis], 1.5e-3);
      EXPECT_NEAR(served().correction_mm[axis], off[axis], 4 * sd[axis]) << "XYZ"[axis] << " at " << degrees;
      largest_mm = std::max(largest_mm, std::abs(off[axis]));
    }
  }
  EXPECT_GT(largest_mm, 0.015) << "there was something to correct";
}

// A fixture that is made anew for every seed.
class SeededTable : public TurningTable {
 public:
  explicit SeededTable(std::uint64_t seed) : TurningTable{turningTableWorld(), seed} {}
  void TestBody() override {}
  void addTo(Pulls& pulls) {
    scenario.run(2s);
    activate();
    turnTo(2 * kTurn / kAngles);
    for (const int k : {5, 8, 11}) {
      turnTo(k * kTurn / kAngles);
      const auto off = truth(), sd = statedSd();
      for (std::size_t axis = 0; axis < 3; ++axis) pulls.add(served().correction_mm[axis], off[axis], sd[axis]);
    }
  }
};

TEST(TurningTables, AreCorrectedWithTheUncertaintyThatTheResultStates) {
  Pulls pulls;
  for (std::uint64_t seed = 1; seed <= runs(8); ++seed) SeededTable{seed}.addTo(pulls);
  pulls.expectHonest();
}

TEST_F(TurningTable, IsHeldThroughASilenceOfItsEncoderAndThenStandsStill) {
  scenario.run(2s);
  activate();
  turnTo(1);
  ASSERT_TRUE(served().valid);
  const auto held_mm = served().correction_mm;
  scenario.inject(FaultKind::angles_silent, 0s, 12s);
  scenario.run(3s);
  EXPECT_TRUE(served().valid);
  EXPECT_TRUE(served().degraded);
  EXPECT_EQ(served().health[kRotary], Health::held);
  EXPECT_TRUE(served().rotary[2].doubtful);
  scenario.run(5s);
  EXPECT_FALSE(served().valid);
  EXPECT_EQ(served().health[kRotary], Health::invalid);
  EXPECT_EQ(served().correction_mm, held_mm) << "frozen, never back to zero";
  scenario.run(6s);
  EXPECT_TRUE(served().valid) << "an absolute encoder that is heard again";
}

world::Config unknownAtPowerUp() {
  auto config = turningTableWorld();
  config.c_power_up_deg = 123.4;
  return config;
}

class IncrementalTable : public TurningTable {
 protected:
  IncrementalTable() : TurningTable{unknownAtPowerUp()} {}
};

TEST_F(IncrementalTable, SaysNothingUntilTheControllerHasReferencedIt) {
  scenario.run(2s);
  activate();
  turnTo(2);
  EXPECT_FALSE(served().valid);
  EXPECT_FALSE(served().referenced);
  EXPECT_EQ(served().correction_mm, (std::array<double, 3>{})) << "123.4 degrees off is no angle at all";
  scenario.push(PoseTold{
      .axes = 4, .angles_rad = {0, 0, 2}, .has_tool = false, .tool = 0, .tool_length_mm = 0, .at = scenario.now()});
  scenario.run(4s);
  ASSERT_TRUE(served().valid);
  turnTo(-1);
  const auto off = truth(), sd = statedSd();
  for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_NEAR(served().correction_mm[axis], off[axis], 4 * sd[axis]);
}

TEST_F(TurningTable, TakesNoMemoryOnTheTickPath) {
  WatchedTwin twin{scenario, config};
  scenario.run(2s);
  activate();
  turnTo(3);
  EXPECT_TRUE(twin.box.state().snapshot.valid);
  EXPECT_EQ(twin.box.state().snapshot.rotary[2].result_id, 31U);
  EXPECT_EQ(twin.allocations, 0U);
}

}  // namespace
}  // namespace probebox::scenario
