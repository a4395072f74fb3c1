#include <functional>
#include <gtest/gtest.h>
#include <numbers>

#include "streams.hpp"

// Errors that every machine and every probe has: each acts where it acts on a machine, and nowhere else.
namespace probebox::world {
namespace {

using testing::quiet;
using testing::run;
using testing::seconds;
using testing::Streams;
using testing::usual;

constexpr double kWaySpeed_mm_s = 10, kDepth_mm = 0.5;

Vector3 centre() {
  return quiet().sphere.centre_mm;
}
double reach_mm() {
  return quiet().sphere.radius_mm + quiet().sphere.stylus_ball_radius_mm;
}
double turned(double turns) {
  return 2 * std::numbers::pi * turns;
}

// In one way of the sphere, a dwell from 6 to 8 s, and out of it until 10 s.
struct WholeTouch {
  World world;
  Streams streams;

  Contact contact() const { return *world.machine().stylus().contact(0); }
  MonoTime begin() const { return contact().begin.rounded(); }
  MonoTime end() const { return contact().end->rounded(); }
  // What the probe shows as the displacement of its stylus, at the last sample before that time.
  Vector3 shown(double before_s) const {
    Vector3 channels_mm{};
    for (const auto& sample : streams.deflections)
      if (sample.at < seconds(before_s))
        for (std::size_t i = 0; i < 3; ++i) channels_mm[i] = 1e-6 * sample.channels_nm[i];
    return quiet().probe.gain * channels_mm;
  }
};

WholeTouch wholeTouch(const Config& config, const Vector3& outward) {
  WholeTouch whole{World{config, 1}, {}};
  Machine& machine = whole.world.machine();
  const auto at = [&](double off_mm) { return centre() + (reach_mm() + off_mm) * outward; };
  const auto take = [&](double until_s) {
    whole.world.advanceTo(seconds(until_s));
    testing::handOver(whole.world, [&](std::span<const Event> some) {
      for (const Event& event : some) whole.streams.add(event);
    });
  };
  EXPECT_TRUE(machine.moveTo(at(20), 200, seconds(1)));
  EXPECT_TRUE(machine.moveTo(at(2), 200, seconds(4)));
  EXPECT_TRUE(machine.moveTo(at(-kDepth_mm), kWaySpeed_mm_s, seconds(5)));
  take(8);
  EXPECT_TRUE(machine.moveTo(at(2), kWaySpeed_mm_s, seconds(8)));
  take(10);
  return whole;
}

void expectSameCounts(const WholeTouch& one, const WholeTouch& other) {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    ASSERT_EQ(one.streams.counts[axis].size(), other.streams.counts[axis].size());
    for (std::size_t i = 0; i < one.streams.counts[axis].size(); ++i)
      ASSERT_EQ(one.streams.counts[axis][i].counts, other.streams.counts[axis][i].counts);
  }
}

const Vector3 kSides[]{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, unit({1, 1, 0.3}), {0, 0, 1}};

TEST(LostMotion, LeavesTheEncodersAndLagsTheSlideBehindThemWhenItTurnsRound) {
  auto config = usual();  // with noise: the same random numbers are drawn
  config.axes.lost_motion_mm = {0.005, 0.008, 0.002};
  for (const Vector3& side : kSides) {
    const auto ideal = wholeTouch(usual(), side), real = wholeTouch(config, side);
    expectSameCounts(ideal, real);
    const Machine& machine = real.world.machine();
    for (std::size_t i = 0; i < 3; ++i) {
      if (side[i] == 0) continue;
      const double half_mm = config.axes.lost_motion_mm[i] / 2, sense = std::copysign(1, side[i]);
      const auto lag = [&](double at_s) {
        return (machine.bodyAt(seconds(at_s)) - machine.positionAt(seconds(at_s)))[i];
      };
      EXPECT_NEAR(lag(7), sense * half_mm, 1e-12) << "in";
      EXPECT_NEAR(lag(9.9), -sense * half_mm, 1e-12) << "out";
    }
    EXPECT_NEAR(norm(machine.bodyAt(real.begin()) - centre()), reach_mm(), 2e-8) << "contact is where the body is";
    EXPECT_NEAR(norm(machine.bodyAt(real.end()) - centre()), reach_mm(), 1e-6) << "at the plane of contact";
  }
}

TEST(LostMotion, PartsTheWayInFromTheWayOutByItself) {
  auto config = quiet();
  config.axes.lost_motion_mm = {0.005, 0, 0};
  const auto real = wholeTouch(config, {1, 0, 0});
  const Machine& machine = real.world.machine();
  EXPECT_NEAR(machine.positionAt(real.end())[0] - machine.positionAt(real.begin())[0], 0.005, 4e-8);
  EXPECT_NEAR(real.shown(8)[0], kDepth_mm - 0.0025, 2e-6) << "the slide is less deep than the encoder says";
  // On the way out the slide rests while the encoder goes through the play.
  const auto moved_mm = [&](double at_s) { return machine.bodyAt(seconds(at_s))[0] - machine.bodyAt(seconds(7.9))[0]; };
  for (double at_s = 8; machine.positionAt(seconds(at_s))[0] - machine.positionAt(seconds(8))[0] < 0.0049; at_s += 1e-4)
    ASSERT_NEAR(moved_mm(at_s), 0, 1e-12);
}

// What play does, in small steps.
Vector3 dragged(const Vector3& slide, const Vector3& to, const Vector3& play) {
  Vector3 at{};
  for (std::size_t i = 0; i < 3; ++i) at[i] = std::clamp(slide[i], to[i] - play[i] / 2, to[i] + play[i] / 2);
  return at;
}

TEST(LostMotion, IsTakenUpOnSlantedWaysAndRoundCentres) {
  const Vector3 play{0.1, 0.3, 0.05};
  for (const double sense : {1, -1}) {
    MotionHistory motion{{3, -4, 0}, play};
    motion.append({8, -4.2, 1}, {20, 1000, 0.001}, seconds(1));
    motion.appendArc(arcFrom({8, -4.2, 1}, {1, 1, 0}, 7 * sense), {20, 1000, 0.001}, seconds(3));
    motion.append({1, 2, 3}, {20, 1000, 0.001}, seconds(10));
    Vector3 slide{3, -4, 0};
    for (int ms = 0; ms < 12'000; ++ms) {
      const MonoTime at = seconds(1e-3 * ms);
      slide = dragged(slide, motion.positionAt(at), play);
      ASSERT_LT(norm(motion.slideAt(at) - slide), 1e-4) << ms << " ms";
    }
    EXPECT_LT(norm(motion.slide() - motion.slideAt(seconds(20))), 1e-12);
  }
}

TEST(LostMotion, IsTakenUpWhenAControlOutsideLeads) {
  auto config = quiet();
  config.axes.lost_motion_mm = {0.005, 0, 0};
  World world{config, 1};
  Lead lead{.motor_mm = config.axes.home_mm, .tool = 1};
  const auto lead_to = [&](double x_mm, int first_ms) {
    const double from_mm = lead.motor_mm[0];
    for (int k = 1; k <= 500; ++k) {
      lead.motor_mm[0] = from_mm + (x_mm - from_mm) * k / 500;
      world.follow(lead, seconds(1e-3 * (first_ms + k - 1)), seconds(1e-3 * (first_ms + k)));
    }
  };
  const auto lag_mm = [&](double at_s) {
    return (world.machine().bodyAt(seconds(at_s)) - world.machine().positionAt(seconds(at_s)))[0];
  };
  lead_to(config.axes.home_mm[0] + 1, 0);
  EXPECT_NEAR(lag_mm(0.5), -0.0025, 1e-9);
  lead_to(config.axes.home_mm[0] + 0.5, 500);
  EXPECT_NEAR(lag_mm(1), 0.0025, 1e-9);
}

TEST(Hysteresis, ShiftsTheZeroToTheSideOfTheLastDeflection) {
  auto config = quiet();
  config.probe.hysteresis_mm = 0.001;
  for (const Vector3& side : kSides) {
    const auto ideal = wholeTouch(quiet(), side), real = wholeTouch(config, side);
    expectSameCounts(ideal, real);
    EXPECT_EQ(real.begin(), ideal.begin());
    EXPECT_LT(norm(real.shown(4)), 2e-6) << "in the middle, until it is deflected";
    EXPECT_LT(norm(real.shown(8) - ideal.shown(8) + 0.0005 * side), 3e-6) << "behind, on the way in";
    EXPECT_LT(norm(real.shown(10) - 0.0005 * side), 3e-6) << "behind, on the way out";
  }
}

TEST(Lobing, ShiftsWhatIsFoundByDirection) {
  auto config = quiet();
  config.probe.lobe_twice_mm = 0.003;
  config.probe.lobe_mm = 0.002;
  config.probe.lobe_along_mm = -0.001;
  const struct {
    Vector3 outward;
    double deeper_mm;
  } directions[]{{{1, 0, 0}, 0.005},
                 {{-1, 0, 0}, 0.001},
                 {{0, 1, 0}, -0.003},
                 {{0, 0, 1}, -0.001},
                 {{0.5, std::sqrt(0.75), 0}, -0.0035}};
  for (const auto& [outward, deeper_mm] : directions) {
    const auto ideal = wholeTouch(quiet(), outward), real = wholeTouch(config, outward);
    expectSameCounts(ideal, real);
    EXPECT_NEAR(norm(real.contact().point - centre()), reach_mm() - deeper_mm, 1e-9);
    EXPECT_NEAR(norm(real.world.machine().bodyAt(real.begin()) - centre()), reach_mm() - deeper_mm, 2e-8);
    EXPECT_LT(norm(real.shown(8) - ideal.shown(8) + deeper_mm * outward), 3e-6);
    EXPECT_LT(norm(real.shown(10)), 2e-6) << "a free stylus knows nothing of it";
  }
}

TEST(Lobing, LetsAPartTurnFurtherUntilItIsFound) {
  auto config = quiet();
  config.part_spindle = {.point_mm = {300, 50, -100}, .ball_radius_mm = 6, .balls_mm = {{0, 60, 80}}};
  const Vector3 stylus{315, 110, -20};
  const auto gapAtContact = [&] {
    Machine machine{config};
    EXPECT_TRUE(machine.turnTo({.c_rad = 0.5}, seconds(1)));
    EXPECT_TRUE(machine.moveTo(stylus, 50, seconds(10)));
    EXPECT_TRUE(machine.turnUntilContact(-0.5, 0.1, seconds(30)));
    const double c_rad = machine.commandedPose().c_rad;
    EXPECT_NEAR(toSeconds(machine.stylus().contact(0)->begin.rounded() - seconds(30)), (0.5 - c_rad) / 0.1, 1e-6);
    return norm(Vector3{300 - 60 * std::sin(c_rad), 50 + 60 * std::cos(c_rad), -20} - stylus) - 9;
  };
  EXPECT_NEAR(gapAtContact(), 0, 1e-7);
  config.probe.lobe_mm = 0.003;
  EXPECT_NEAR(gapAtContact(), -0.003, 1e-4) << "the ball comes nearly along X";
}

TEST(Lobing, FollowsTheBallThatSlidesRound) {
  auto config = quiet();
  config.probe.lobe_mm = 0.002;
  config.probe.friction = 0;
  World world{config, 1};
  Machine& machine = world.machine();
  ASSERT_TRUE(machine.moveTo(centre() + Vector3{20, 0, 0}, 200, seconds(1)));
  ASSERT_TRUE(machine.moveTo(centre() + Vector3{reach_mm() - 0.3, 0, 0}, 10, seconds(5)));
  ASSERT_TRUE(machine.slideRound(centre(), 3, 10, seconds(8)));
  for (double at_s = 9; at_s < 12; at_s += 0.1) {
    const Vector3 ball = machine.bodyAt(seconds(at_s)) + machine.stylusDisplacementAt(seconds(at_s)) - centre();
    ASSERT_NEAR(norm(ball), reach_mm() - 0.002 * std::cos(3 * std::atan2(ball[1], ball[0])), 1e-6) << at_s;
  }
}

TEST(Curvature, BendsEachChannelByItsDeflection) {
  auto config = quiet();
  config.probe.curvature = 0.01;
  const auto ideal = wholeTouch(quiet(), unit({1, 2, 0.5})), real = wholeTouch(config, unit({1, 2, 0.5}));
  expectSameCounts(ideal, real);
  ASSERT_EQ(real.streams.deflections.size(), ideal.streams.deflections.size());
  for (std::size_t k = 0; k < real.streams.deflections.size(); ++k) {
    for (std::size_t i = 0; i < 3; ++i) {
      const double straight_nm = ideal.streams.deflections[k].channels_nm[i];
      const double bent_nm = straight_nm * (1 + 0.01 * std::abs(straight_nm) / (1e6 * config.probe.range_mm));
      ASSERT_NEAR(real.streams.deflections[k].channels_nm[i], bent_nm, 1.5);
    }
  }
}

TEST(Drift, CarriesTheBodyAwayUnseenByTheEncoders) {
  auto config = usual();
  config.axes.drift = {.rate_mm_min = {0.06, -0.03, 0.012}};
  for (const Vector3& side : kSides) {
    const auto ideal = wholeTouch(usual(), side), real = wholeTouch(config, side);
    expectSameCounts(ideal, real);
    const Machine& machine = real.world.machine();
    for (const double at_s : {2.0, 7.0, 9.0}) {
      const Vector3 away = machine.bodyAt(seconds(at_s)) - machine.positionAt(seconds(at_s));
      EXPECT_LT(norm(away - at_s * Vector3{0.001, -0.0005, 0.0002}), 1e-12);
    }
    EXPECT_NEAR(norm(machine.bodyAt(real.begin()) - centre()), reach_mm(), 1e-6) << "contact is where the body is";
    EXPECT_LT(norm(machine.stylusDisplacementAt(real.begin())), 2e-3) << "and the stylus goes on from there";
  }
  config.axes.drift.time_constant_s = 120;
  const World world{config, 1};
  const auto away = [&](double at_s) {
    return (world.machine().bodyAt(seconds(at_s)) - world.machine().positionAt(seconds(at_s)))[0];
  };
  EXPECT_NEAR(away(120), 0.12 * (1 - std::exp(-1)), 1e-9);
  EXPECT_NEAR(away(3600), 0.12, 1e-9);
}

TEST(Drift, OfTheProbeIsSeenInItsZeroAlone) {
  auto config = quiet();
  config.probe.drift = {.rate_mm_min = {0.006, 0, -0.003}};
  const auto ideal = wholeTouch(quiet(), {1, 0, 0}), real = wholeTouch(config, {1, 0, 0});
  expectSameCounts(ideal, real);
  EXPECT_EQ(real.begin(), ideal.begin());
  for (const double at_s : {2.0, 8.0, 10.0})
    EXPECT_LT(norm(real.shown(at_s) - ideal.shown(at_s) - at_s * Vector3{0.0001, 0, -0.00005}), 3e-6);
}

Config vibrating(Vibrates of) {
  auto config = quiet();
  config.vibrations.push_back({.of = of, .frequency_hz = 495, .amplitude_mm = 0.0005, .direction = {2, 0, 0}});
  return config;
}

TEST(Vibration, OfTheAxesIsSeenByTheEncodersAboveHalfTheirRateToo) {
  const auto ideal = wholeTouch(quiet(), {1, 0, 0}), real = wholeTouch(vibrating(Vibrates::axes), {1, 0, 0});
  const auto& counts = real.streams.counts[0];
  const auto& still = ideal.streams.counts[0];
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const double since_s = toSeconds(counts[i].at - MonoTime{}) - quiet().delays.tau_machine_s[0];
    ASSERT_NEAR(static_cast<double>(counts[i].counts - still[i].counts), 500 * std::sin(turned(495 * since_s)), 1.5);
    ASSERT_EQ(real.streams.counts[1][i].counts, ideal.streams.counts[1][i].counts);
  }
  EXPECT_LT(norm(real.shown(4)), 2e-6);
  EXPECT_NEAR(norm(real.world.machine().bodyAt(real.begin()) - centre()), reach_mm(), 2e-8);
}

TEST(Vibration, OfTheBodyIsSeenByAStylusInContactAlone) {
  const auto ideal = wholeTouch(quiet(), {1, 0, 0}), real = wholeTouch(vibrating(Vibrates::body), {1, 0, 0});
  expectSameCounts(ideal, real);
  EXPECT_LT(norm(real.shown(4)), 2e-6) << "before contact";
  EXPECT_NEAR(norm(real.world.machine().bodyAt(real.begin()) - centre()), reach_mm(), 2e-8);
  for (std::size_t k = 0; k < real.streams.deflections.size(); ++k) {
    const auto& sample = real.streams.deflections[k];
    if (sample.at < seconds(6) || sample.at > seconds(8)) continue;
    const double since_s = toSeconds(sample.at - MonoTime{}) - quiet().delays.tau_probe_s;
    Vector3 change_mm{};
    for (std::size_t i = 0; i < 3; ++i)
      change_mm[i] = 1e-6 * (sample.channels_nm[i] - ideal.streams.deflections[k].channels_nm[i]);
    ASSERT_NEAR((quiet().probe.gain * change_mm)[0], -0.0005 * std::sin(turned(495 * since_s)), 3e-6);
  }
}

TEST(Vibration, OfTheProbeIsSeenWithoutContactToo) {
  const auto ideal = wholeTouch(quiet(), {0, 1, 0}), real = wholeTouch(vibrating(Vibrates::probe), {0, 1, 0});
  expectSameCounts(ideal, real);
  EXPECT_EQ(real.begin(), ideal.begin());
  double most_mm = 0;
  for (double at_s = 2; at_s < 2.5; at_s += 0.001) most_mm = std::max(most_mm, std::abs(real.shown(at_s)[0]));
  EXPECT_NEAR(most_mm, 0.0005, 5e-6);
}

TEST(UnevenScrew, MovesTheNutByTheWarmthBeforeIt) {
  auto config = quiet();
  config.machine.screws[0] = board::ScrewDescription{};
  config.machine.screws[0]->length_mm = 1000;
  config.screws[0] = board::WorldScrew{.cold_um = 60, .warm_um = 60, .time_constant_s = 1};
  const Screws even{config, 1};
  config.screws[0]->heat_shares = {3, 2, 1, 2};
  const Screws uneven{config, 1};
  const struct {
    double at_mm, share;
  } places[]{{0, 0}, {125, 1.5 / 8}, {250, 3.0 / 8}, {500, 5.0 / 8}, {750, 6.0 / 8}, {1000, 1}, {1125, 9.0 / 8}};
  for (const auto& [at_mm, share] : places) {
    EXPECT_NEAR(even.nutError_mm(0, at_mm, seconds(5)), 0.06 * at_mm / 1000, 1e-12);
    EXPECT_NEAR(uneven.nutError_mm(0, at_mm, seconds(5)), 0.06 * share, 1e-12) << at_mm;
    EXPECT_NEAR(uneven.nutPosition_mm(0, uneven.motorPosition_mm(0, at_mm, seconds(5)), seconds(5)), at_mm, 1e-9);
  }
  EXPECT_EQ(uneven.extension_um(0, seconds(5)), even.extension_um(0, seconds(5))) << "what its sensor sees";
}

TEST(MachineErrors, AllAtOnceLeaveTheSkipFunctionWhereContactIs) {
  auto config = vibrating(Vibrates::body);
  config.axes.lost_motion_mm = {0.005, 0.005, 0.005};
  config.axes.drift = {.rate_mm_min = {0.0005, 0.0005, 0}};
  config.linear_axes.scale = {20e-6, 20e-6, 20e-6};
  config.linear_axes.squareness_rad = {5e-5, 5e-5, 5e-5};
  config.probe.lobe_mm = 0.003;
  for (const Vector3& side : kSides) {
    World world{config, 1};
    Machine& machine = world.machine();
    ASSERT_TRUE(machine.moveTo(centre() + 20.0 * side, 200, seconds(1)));
    const auto met = machine.moveUntilContact(centre(), 20, seconds(4), 0.3);
    ASSERT_TRUE(met);
    ASSERT_EQ(machine.stylus().contactCount(), 1U);
    EXPECT_LT(norm(*met - machine.positionAt(machine.stylus().contact(0)->begin.rounded())), 1e-7);
    EXPECT_NEAR(norm(machine.commandedPosition() - *met), 0.3, 1e-9);
    EXPECT_LT(norm(machine.stylusDisplacementAt(machine.stylus().contact(0)->begin.rounded())), 1e-4);
    ASSERT_TRUE(machine.moveTo(centre() + 20.0 * side, 20, seconds(8)));
    EXPECT_FALSE(machine.touching());
    EXPECT_EQ(machine.stylus().contactCount(), 1U) << "it leaves the surface without meeting it again";
  }
}

}  // namespace
}  // namespace probebox::world
