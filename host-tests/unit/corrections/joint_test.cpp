#include "joint.hpp"

namespace probebox::corrections {
namespace {

TEST_F(Joint, IsNotMovedBeforeEverythingIsKnown) {
  machine.extension_um = 40;
  run(1);
  EXPECT_FALSE(machine.snapshot().valid) << "no axis is referenced";
  EXPECT_FALSE(machine.snapshot().referenced);
  EXPECT_EQ(machine.snapshot().health[0], Health::invalid);
  machine.home();
  run(1);
  EXPECT_TRUE(machine.snapshot().valid);
  EXPECT_TRUE(machine.snapshot().referenced);
  EXPECT_TRUE(machine.snapshot().screw_sensors_good);
  EXPECT_NEAR(joint_mm[0], machine.wanted_x_mm(), 2e-6);
  EXPECT_TRUE(machine.snapshot().settled);
}

TEST_F(Joint, FollowsTheScrewWithTheSignThatIsAdded) {
  start();
  machine.extension_um = 60;
  run(3);
  EXPECT_NEAR(joint_mm[0], -(300 + 100) / 800.0 * 0.060, 2e-6);
  EXPECT_EQ(joint_mm[1], 0);
  machine.position_mm[0] = 299;  // 1 mm within a tick is no error of the encoder at this speed
  run(1);
  EXPECT_NEAR(joint_mm[0], machine.wanted_x_mm(), 2e-6);
  EXPECT_LE(largest_step_mm, kStep_mm);
}

TEST_F(Joint, WalksAtTheLimitOfRateAndIsToldThatItDoes) {
  start();
  machine.extension_um = 200;  // 0.1 mm wanted
  run(1);
  EXPECT_NEAR(joint_mm[0], -0.05, 0.006);
  EXPECT_FALSE(machine.snapshot().settled);
  EXPECT_TRUE(machine.snapshot().valid);
  run(2);
  EXPECT_NEAR(joint_mm[0], -0.1, 2e-6);
  EXPECT_TRUE(machine.snapshot().settled);
  EXPECT_LE(largest_step_mm, kStep_mm);
}

// Behind half a second in which the computer did something else, all its records come at once.
TEST_F(Joint, GoesOnFromWhereItIsWhenRecordsComeLateAndTogether) {
  start();
  machine.extension_um = 200;
  run(0.5);
  const double before_mm = joint_mm[0];
  machine.published = false;
  machine.run(0.5);
  machine.published = true;
  largest_step_mm = 0;
  run(0.01);
  EXPECT_LT(joint_mm[0], before_mm);
  EXPECT_LE(largest_step_mm, 0.05 * 0.05 + 2e-6);
  largest_step_mm = 0;
  run(3);
  EXPECT_NEAR(joint_mm[0], -0.1, 2e-6);
  EXPECT_LE(largest_step_mm, kStep_mm);
}

TEST_F(Joint, StopsAtTheLimitOfSizeDegraded) {
  machine.position_mm[0] = 700;
  start();
  machine.extension_um = 250;  // 0.25 mm wanted
  run(6);
  EXPECT_NEAR(joint_mm[0], -0.2, 1e-9);
  EXPECT_TRUE(machine.snapshot().valid);
  EXPECT_TRUE(machine.snapshot().degraded);
  EXPECT_TRUE(machine.snapshot().saturated);
}

TEST_F(Joint, IsHeldThroughASensorsSilenceAndLeftStandingAfterIt) {
  machine.extension_um = 50;
  start();
  const double before_mm = joint_mm[0];
  machine.sensor = false;
  run(2.5);  // stale after 1 s, held for 2
  EXPECT_TRUE(machine.snapshot().valid);
  EXPECT_TRUE(machine.snapshot().degraded);
  EXPECT_EQ(machine.snapshot().health[0], Health::held);
  EXPECT_GE(machine.snapshot().age_ms, 1000U);
  run(2);
  EXPECT_FALSE(machine.snapshot().valid);
  EXPECT_TRUE(machine.snapshot().degraded);
  EXPECT_EQ(machine.snapshot().axes[0].screw.sensor_fault, SensorFault::silent);
  EXPECT_NEAR(machine.snapshot().correction_mm[0], joint_mm[0], 1e-12) << "frozen, not ramped to zero";
  EXPECT_LT(joint_mm[0], 0);
  machine.sensor = true;
  machine.extension_um = 70;
  run(3);
  EXPECT_TRUE(machine.snapshot().valid);
  EXPECT_FALSE(machine.snapshot().degraded);
  EXPECT_NEAR(joint_mm[0], machine.wanted_x_mm(), 2e-6);
  EXPECT_LE(largest_step_mm, kStep_mm);
  EXPECT_NE(joint_mm[0], before_mm);
}

TEST_F(Joint, IsHeldWhileAnExtensionIsImpossible) {
  machine.extension_um = 50;
  start();
  const double before_mm = joint_mm[0];
  machine.extension_um = 5000;
  run(1);
  EXPECT_EQ(machine.snapshot().axes[0].screw.sensor_fault, SensorFault::out_of_range);
  EXPECT_EQ(machine.snapshot().axes[0].screw.extension_um, 50) << "nor does the line over the position believe it";
  EXPECT_NEAR(machine.snapshot().axes[0].screw.slope, -50e-3 / 800, 1e-12);
  EXPECT_TRUE(machine.snapshot().degraded);
  EXPECT_EQ(joint_mm[0], before_mm);
}

TEST_F(Joint, StandsWhereItIsWhenTheReferenceIsLost) {
  machine.extension_um = 50;
  start();
  const double before_mm = joint_mm[0];
  machine.power_up += 20'000'000;  // counts jump by 20 mm
  run(1);
  EXPECT_FALSE(machine.snapshot().valid);
  EXPECT_FALSE(machine.snapshot().referenced);
  EXPECT_EQ(machine.snapshot().axes[0].last_fault, ReferenceFault::impossible_speed);
  EXPECT_EQ(machine.snapshot().correction_mm[0], before_mm);
  machine.home();
  run(1);
  EXPECT_TRUE(machine.snapshot().valid);
  EXPECT_NEAR(joint_mm[0], machine.wanted_x_mm(), 2e-6);
  EXPECT_LE(largest_step_mm, kStep_mm);
}

TEST_F(Joint, SeesTheHeartbeatStopWithTheChain) {
  machine.extension_um = 50;
  start();
  const auto beats = machine.snapshot().heartbeat;
  run(1);
  EXPECT_NEAR(machine.snapshot().heartbeat - beats, 10, 1);
  machine.encoders = false;
  run(1);
  const auto stopped = machine.snapshot().heartbeat;
  EXPECT_TRUE(machine.snapshot().degraded);
  EXPECT_TRUE(machine.snapshot().valid) << "held";
  run(2);
  EXPECT_EQ(machine.snapshot().heartbeat, stopped);
  EXPECT_FALSE(machine.snapshot().valid);
  machine.encoders = true;
  run(1);
  EXPECT_TRUE(machine.snapshot().valid);
  EXPECT_LE(largest_step_mm, kStep_mm);
}

// A control that looks at it alone would let go of a value that the box still holds.
TEST_F(Joint, SeesTheHeartbeatGoOnWhileASourceIsHeldAndWhenItSaysNothing) {
  machine.extension_um = 50;
  start();
  machine.sensor = false;
  run(1.5);  // stale after 1 s, held for 2
  for (const bool is_valid : {true, false}) {
    EXPECT_EQ(machine.snapshot().valid, is_valid);
    EXPECT_TRUE(machine.snapshot().degraded);
    const auto beats = machine.snapshot().heartbeat;
    run(1);
    EXPECT_NEAR(machine.snapshot().heartbeat - beats, 10, 1);
    run(2);
  }
}

// A probe is silent in every cut: a screw needs its reference and its sensor, and nothing else.
TEST_F(Joint, FollowsAWarmScrewWithoutASampleOfTheProbe) {
  machine.probe = false;
  machine.extension_um = 50;
  start();
  EXPECT_TRUE(machine.snapshot().valid);
  EXPECT_FALSE(machine.snapshot().degraded);
  EXPECT_NEAR(joint_mm[0], machine.wanted_x_mm(), 2e-6);
  const auto beats = machine.snapshot().heartbeat;
  machine.extension_um = 80;
  run(3);
  EXPECT_NEAR(machine.snapshot().heartbeat - beats, 30, 1);
  EXPECT_NEAR(joint_mm[0], machine.wanted_x_mm(), 2e-6);
  EXPECT_LE(machine.snapshot().age_ms, 20U);
  EXPECT_LE(largest_step_mm, kStep_mm);
}

TEST_F(Joint, SeesNoStepWhereTheProbeOrTheClockComesAndGoes) {
  machine.extension_um = 100;
  start();
  run(2);
  for (int round = 0; round < 20; ++round) {
    bool& gone = round % 2 == 0 ? machine.probe : machine.clock;
    gone = false;
    run(0.03 + 0.02 * round);
    EXPECT_TRUE(machine.snapshot().valid) << round;
    EXPECT_FALSE(machine.snapshot().degraded) << round;
    machine.position_mm[0] += 1;
    gone = true;
    run(0.1);
    EXPECT_NEAR(joint_mm[0], machine.wanted_x_mm(), 2e-6) << round;
  }
  EXPECT_LE(largest_step_mm, kStep_mm);
}

TEST_F(Joint, SeesTheHeartbeatStopAndTheValueHeldWhereNeitherSamplesNorCountsCome) {
  machine.extension_um = 50;
  machine.probe = false;
  start();
  machine.encoders = false;
  run(0.4);
  EXPECT_EQ(machine.snapshot().health[0], Health::held);
  const auto beats = machine.snapshot().heartbeat;
  run(1);
  EXPECT_EQ(machine.snapshot().heartbeat, beats);
  run(1.5);
  EXPECT_FALSE(machine.snapshot().valid);
}

TEST_F(Joint, IsTakenOverFromAStandingCorrection) {
  // The axes stand 0.1 mm off from before the restart.
  joint_mm[0] = -0.1;
  machine.corrections.push(AppliedRestored{.correction_mm = {-0.1, 0, 0}, .at = machine.now});
  run(0.5);
  EXPECT_FALSE(machine.snapshot().valid);
  EXPECT_NEAR(machine.snapshot().correction_mm[0], -0.1, 1e-9) << "a value of zero would move the joint";
  machine.home();
  machine.extension_um = 40;  // 0.02 mm wanted
  run(0.02);
  EXPECT_TRUE(machine.snapshot().valid);
  EXPECT_NEAR(machine.snapshot().correction_mm[0], -0.1, 0.005) << "it sets out from where the joint stands";
  run(4);
  EXPECT_NEAR(joint_mm[0], machine.wanted_x_mm(), 2e-6);
  EXPECT_LE(largest_step_mm, kStep_mm);
}

TEST_F(Joint, SeesNoStepWhereOnlyBoundsAreKnownOfWhatWasServed) {
  // It stands anywhere within 0.05 mm of what the disk has: a second at its limit of rate.
  joint_mm[0] = -0.07;
  machine.corrections.push(AppliedRestored{.correction_mm = {-0.1, 0, 0}, .at = machine.now, .doubt_mm = {0.05, 0, 0}});
  EXPECT_NEAR(machine.snapshot().correction_mm[0], -0.1, 1e-9) << "in the first snapshot, before any time has passed";
  EXPECT_FALSE(machine.snapshot().valid);
  run(0.5);  // an axis is homed that has been seen to stand still
  machine.home();
  machine.extension_um = 40;
  run(0.4);
  EXPECT_FALSE(machine.snapshot().valid) << "the joint could not have come from everywhere within it";
  run(0.3);
  EXPECT_TRUE(machine.snapshot().valid);
}

TEST_F(Joint, GoesNoFurtherThanTheDiskKnows) {
  start();
  machine.corrections.push(ServableWithin{.least_mm = {-0.01, 0, 0}, .greatest_mm = {0.01, 0, 0}, .at = machine.now});
  machine.extension_um = 100;  // 0.05 mm wanted
  run(1);
  EXPECT_TRUE(machine.snapshot().valid);
  EXPECT_FALSE(machine.snapshot().settled);
  EXPECT_FALSE(machine.snapshot().degraded) << "a disk may take a while";
  EXPECT_GE(joint_mm[0], -0.01);
  run(2);
  EXPECT_TRUE(machine.snapshot().degraded);
  EXPECT_GE(joint_mm[0], -0.01);
  machine.corrections.push(ServableWithin{.least_mm = {-1, -1, -1}, .greatest_mm = {1, 1, 1}, .at = machine.now});
  run(2);
  EXPECT_FALSE(machine.snapshot().degraded);
  EXPECT_LT(joint_mm[0], -0.03);
  EXPECT_LE(largest_step_mm, kStep_mm);
}

TEST_F(Joint, IsTakenBackWhenTheLastSourceIsSwitchedOff) {
  machine.extension_um = 100;
  start();
  run(2);
  ASSERT_LT(joint_mm[0], -0.04);
  machine.corrections.push(SourcesEnabled{.mask = 0, .at = machine.now});
  run(0.1);
  EXPECT_TRUE(machine.snapshot().valid) << "on its way";
  run(2);
  EXPECT_EQ(joint_mm[0], 0);
  EXPECT_TRUE(machine.snapshot().valid) << "no correction is a correction of zero";
  EXPECT_FALSE(machine.snapshot().degraded);
  EXPECT_LE(largest_step_mm, kStep_mm);
}

TEST_F(Joint, IsMovedBySourcesThatMachineTomlDoesNotDescribeNever) {
  machine.extension_um = 40;
  start();
  for (const auto kind : {SourceKind::swivel, SourceKind::rotary}) {
    machine.corrections.push(SourcesEnabled{.mask = bitOf(kind), .at = machine.now});
    run(1);
    EXPECT_FALSE(machine.snapshot().valid);
  }
}

// While nobody knew the position, or the reading, the screw became cold: it is not walked after by its own rate.
TEST(SlowScrew, IsAsItsSensorSaysOnceItsInputsAreBack) {
  for (const bool of_sensor : {false, true}) {
    auto config = MachineOnADesk::usual();
    config.screws[0].limits.rate_um_s = 5;
    MachineOnADesk machine{config};
    machine.extension_um = 100;
    machine.run(0.3);
    machine.home();
    machine.run(3);
    ASSERT_NEAR(machine.snapshot().correction_mm[0], machine.wanted_x_mm(), 2e-6);
    bool& input = of_sensor ? machine.sensor : machine.encoders;
    input = false;
    machine.extension_um = 40;
    machine.run(20);
    EXPECT_FALSE(machine.snapshot().valid);
    input = true;
    machine.home();
    for (int i = 0; i < 300 && !(machine.snapshot().valid && machine.snapshot().settled); ++i) machine.run(0.01);
    EXPECT_TRUE(machine.snapshot().settled);
    EXPECT_NEAR(machine.snapshot().correction_mm[0], machine.wanted_x_mm(), 2e-6);
    machine.extension_um = 60;
    machine.run(1);
    EXPECT_NEAR(machine.snapshot().correction_mm[0], -400.0 / 800 * 0.045, 3e-4) << "5 um a second";
  }
}

TEST_F(Joint, AddsCentrelineAndScrewAndGoesWithZ) {
  start();
  machine.corrections.push(SourcesEnabled{.mask = 0b1001, .at = machine.now});
  run(0.2);
  EXPECT_FALSE(machine.snapshot().valid) << "no centreline is known: not zero, but nothing";
  machine.corrections.push(CentrelineActivated{.result_id = 4,
                                               .centre_mm = {0.03, -0.02},
                                               .slope = {1e-4, 0},
                                               .reference_z_mm = -100,
                                               .sd_centre_mm = {},
                                               .sd_slope = {},
                                               .at = machine.now});
  machine.extension_um = 20;
  run(3);
  EXPECT_TRUE(machine.snapshot().valid);
  EXPECT_TRUE(machine.snapshot().centreline_calibrated);
  EXPECT_NEAR(joint_mm[0], 0.03 + machine.wanted_x_mm(), 2e-6);
  EXPECT_NEAR(joint_mm[1], -0.02, 2e-6);
  machine.position_mm[2] = -99.5;
  run(1);
  EXPECT_NEAR(joint_mm[0], 0.03 + 0.5e-4 + machine.wanted_x_mm(), 2e-6);
  machine.corrections.push(CentrelineActivated{});
  run(1);
  EXPECT_FALSE(machine.snapshot().valid);
  EXPECT_LE(largest_step_mm, kStep_mm);
}

TEST_F(Joint, IsToldOfEveryChangeBySequence) {
  start();
  run(1);
  const auto quiet = machine.snapshot().sequence;
  run(1);
  EXPECT_EQ(machine.snapshot().sequence, quiet);
  machine.extension_um = 30;
  run(0.5);
  EXPECT_NE(machine.snapshot().sequence, quiet);
}

TEST_F(Joint, IsKnownAtEveryTrigger) {
  machine.extension_um = 100;
  start();
  run(2);
  machine.corrections.push(Edge{LineRole::trigger, 0, Level::active, 1, machine.now - std::chrono::microseconds{500}});
  run(0.1);
  const auto& stamp = machine.snapshot().last_trigger;
  EXPECT_EQ(stamp.number, 1U);
  EXPECT_TRUE(stamp.has_position[0]);
  EXPECT_NEAR(stamp.position_mm[0], machine.position_mm[0], 1e-6);
  EXPECT_EQ(stamp.served.correction_nm[0], -50'000);
  EXPECT_TRUE(stamp.served.valid);
  for (std::uint32_t i = 2; i <= 40; ++i)
    machine.corrections.push(Edge{LineRole::trigger, 0, Level::active, i, machine.now}), machine.run(0.02);
  EXPECT_EQ(machine.snapshot().last_trigger.number, 40U);
}

TEST_F(Joint, IsNotReferencedByAMachineThatMoves) {
  run(0.2);
  for (int i = 0; i < 200; ++i) {
    machine.position_mm[0] += 0.05;
    machine.tick();
  }
  machine.home();
  run(0.2);
  EXPECT_EQ(machine.snapshot().refused_homings, 1U);
  EXPECT_FALSE(machine.snapshot().axes[0].referenced);
  EXPECT_TRUE(machine.snapshot().axes[1].referenced);
}

TEST_F(Joint, HasACutAnnouncedByLineOrWord) {
  EXPECT_FALSE(machine.snapshot().inhibited);
  machine.corrections.push(Edge{LineRole::inhibit, 1, Level::active, 1, machine.now});
  machine.corrections.push(CutInhibit{.active = true, .at = machine.now});
  machine.corrections.push(Edge{LineRole::inhibit, 1, Level::inactive, 2, machine.now});
  EXPECT_TRUE(machine.snapshot().inhibited);
  machine.corrections.push(CutInhibit{.active = false, .at = machine.now});
  EXPECT_FALSE(machine.snapshot().inhibited);
}

}  // namespace
}  // namespace probebox::corrections
