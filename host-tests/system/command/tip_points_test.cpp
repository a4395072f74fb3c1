#include "tools/probebox/tables/tip_points.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <random>

#include "protocol/codec/block.hpp"

// From samples to the centre of the tip and the surface, with known truth: a ball that slides around a sphere.
namespace probebox::command {
namespace {

using testing::HasSubstr;
using Three = std::array<double, 3>;

constexpr std::size_t kCount = 64;
constexpr double kPeriod_s = 0.0005, kSphere_mm = 12.5, kBall_mm = 3;

messages::Descriptor scanning() {
  messages::Descriptor descriptor;
  for (const auto* name : {"deflection_a", "deflection_b", "deflection_c"}) descriptor.channels.push_back({name, "nm"});
  for (const auto* name : {"position_x", "position_y", "position_z"})
    descriptor.channels.push_back({name, "mm", 1e-6, 8});
  descriptor.channels.push_back({"flags", "", 1, 2, false});
  descriptor.gain = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  descriptor.delay = {true, {5e-3, 5e-3, 5e-3}, {2e-5, 2e-5, 2e-5}, 7};
  descriptor.tip.has_deflection = true;
  descriptor.tip.referenced = 7;
  descriptor.tip.ball_radius_mm = kBall_mm;
  descriptor.tip.noise_nm = 400;
  descriptor.tip.gain_result_id = 7;
  for (auto& row : descriptor.tip.gain_sd) row = {0.002, 0.002, 0.002};
  return descriptor;
}

// One block of a scan around the equator at speed_mm_s, the stylus dragged by friction.
struct Scan {
  double deflection_mm{0.3}, friction{0.15}, speed_mm_s{20};
  Three late_s{};                                                // what the delay in force is off by
  std::array<Three, 3> gain{{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};  // the true one, diagonal
  Three offset_mm{100, -50, 20};                                 // reference of the axes
  double noise_mm{}, encoder_noise_mm{};
  double lifts_at_s{1e9};  // from there on the ball flies, and the stylus still swings across the normal by swing_mm
  double swing_mm{0.03};

  Three normal(double t) const {
    const double turn = 0.7 + speed_mm_s * t / (kSphere_mm + kBall_mm);
    return {std::cos(turn), std::sin(turn), 0};
  }
  Three along(double t) const { return {-normal(t)[1], normal(t)[0], 0}; }
  Three tip(double t, std::size_t) const {
    const Three n = normal(t);
    return {(kSphere_mm + kBall_mm) * n[0], (kSphere_mm + kBall_mm) * n[1], 0};
  }
  Three pushed(double t) const {
    if (t >= lifts_at_s) return {-swing_mm * normal(t)[1], swing_mm * normal(t)[0], 0};
    const Three n = normal(t), u = along(t);
    const double drag = speed_mm_s > 0 ? friction : 0;
    return {deflection_mm * (n[0] - drag * u[0]), deflection_mm * (n[1] - drag * u[1]), 0};
  }
  std::vector<std::int64_t> columns(std::mt19937_64& random, std::int64_t flags = 0) const {
    std::normal_distribution<double> normal_noise;
    std::vector<std::int64_t> all(7 * kCount);
    for (std::size_t k = 0; k < kCount; ++k) {
      const double t = static_cast<double>(k) * kPeriod_s;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double channel = pushed(t)[axis] / gain[axis][axis] + noise_mm * normal_noise(random);
        all[axis * kCount + k] = std::llround(1e6 * channel);
        const double at = t + late_s[axis];
        const double read = tip(at, axis)[axis] - pushed(at)[axis] - offset_mm[axis];
        all[(3 + axis) * kCount + k] = std::llround(1e6 * (read + encoder_noise_mm * normal_noise(random)));
      }
      all[6 * kCount + k] = flags;
    }
    return all;
  }
};

codec::BlockHeader header(std::int64_t first = 1000) {
  return {
      {first}, kCount, 2, {Tick{first / 2}, monoTime(first * 500'000), 1'000'000LL << 32, 50, ClockState::locked, 0}};
}

TEST(TipPoints, FindTheTipAndTheSurfaceWhateverFrictionDoes) {
  std::mt19937_64 random{1};
  auto descriptor = scanning();
  const Scan scan;
  descriptor.tip.offset_mm = scan.offset_mm;
  for (const double friction : {0.0, 0.15, 0.3}) {
    Scan dragged = scan;
    dragged.friction = friction;
    const auto columns = dragged.columns(random);
    TipPoints points{0.35};
    const link::DecodedBlock block{descriptor, header(), columns};
    for (std::size_t k = 0; k < kCount; ++k) {
      const auto& point = points.of(block, k);
      const auto tip = dragged.tip(static_cast<double>(k) * kPeriod_s, 0);
      const auto n = dragged.normal(static_cast<double>(k) * kPeriod_s);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(point.tip_mm[axis], tip[axis], 3e-6);
        EXPECT_NEAR(point.surface_mm[axis], kSphere_mm * n[axis], 0.02) << "at the ends the motion bends";
        EXPECT_GT(point.sd_tip_mm[axis], 0);
        EXPECT_GT(point.sd_surface_mm[axis], 0);
      }
      EXPECT_NEAR(std::hypot(point.surface_mm[0], point.surface_mm[1]), kSphere_mm, 1e-4);
    }
    EXPECT_EQ(points.tips(), kCount);
    EXPECT_EQ(points.surfaces(), kCount);
    EXPECT_TRUE(points.missing().empty());
  }
}

// Mean square of error over stated sd, over worlds with errors of gain, delay and samples.
TEST(TipPoints, AreAsUncertainAsTheySay) {
  std::mt19937_64 random{2};
  std::normal_distribution<double> normal;
  auto descriptor = scanning();
  Scan scan;
  descriptor.tip.offset_mm = scan.offset_mm;
  double tip = 0, radius = 0, stated = 0;
  constexpr int kWorlds = 400;
  for (int world = 0; world < kWorlds; ++world) {
    scan.noise_mm = 0.4e-3;
    scan.encoder_noise_mm = world % 2 == 0 ? 0.0 : 0.8e-3;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      scan.late_s[axis] = 2e-5 * normal(random);
      for (std::size_t i = 0; i < 3; ++i) descriptor.gain[axis][i] = (axis == i ? 1.0 : 0.0) + 0.002 * normal(random);
    }
    const auto columns = scan.columns(random);
    TipPoints points{0.2};
    constexpr std::size_t kMiddle = kCount / 2;
    const auto& point = points.of({descriptor, header(), columns}, kMiddle);
    const auto truth = scan.tip(kMiddle * kPeriod_s, 0);
    const auto n = scan.normal(kMiddle * kPeriod_s);
    double variance = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      tip += std::pow((point.tip_mm[axis] - truth[axis]) / point.sd_tip_mm[axis], 2) / 3;
      variance += std::pow(n[axis] * point.sd_tip_mm[axis], 2);
    }
    const double off = std::hypot(point.surface_mm[0], point.surface_mm[1], point.surface_mm[2]) - kSphere_mm;
    radius += off * off / variance;
    stated += std::pow(off / point.sd_along_normal_mm, 2);
  }
  EXPECT_NEAR(tip / kWorlds, 1, 0.2);
  EXPECT_NEAR(radius / kWorlds, 1, 0.35) << "along the normal the direction does not matter";
  EXPECT_NEAR(stated / kWorlds, 1, 0.35);
}

// A tip that rests may be held by friction: the same point, less certain.
TEST(TipPoints, TellFrictionInTheUncertaintyOfATipAtRest) {
  std::mt19937_64 random{3};
  auto descriptor = scanning();
  Scan resting;
  descriptor.tip.offset_mm = resting.offset_mm;
  resting.speed_mm_s = 0;
  const auto columns = resting.columns(random);
  const auto sdAcross = [&](double friction) {
    TipPoints points{friction};
    return points.of({descriptor, header(), columns}, 20).sd_surface_mm[2];
  };
  EXPECT_NEAR(sdAcross(0.2), kBall_mm * 0.1, 0.02);
  EXPECT_LT(sdAcross(0), 0.02);
}

TEST(TipPoints, GiveNoNumberWhereSomethingIsMissingAndSayWhat) {
  std::mt19937_64 random{4};
  const Scan scan;
  const auto columns = scan.columns(random);
  const auto lacking = [&](auto&& change, std::int64_t flags = 0) {
    auto descriptor = scanning();
    change(descriptor);
    const auto flagged = flags == 0 ? columns : scan.columns(random, flags);
    TipPoints points{0.2};
    const auto& point = points.of({descriptor, header(), flagged}, 5);
    EXPECT_EQ(points.missing().size(), 1U);
    const auto& [why, missing] = *points.missing().begin();
    EXPECT_EQ(missing.first, 1000);
    EXPECT_EQ(missing.samples, kCount);
    const bool has_sd = !std::isnan(point.sd_tip_mm[0]) || !std::isnan(point.sd_surface_mm[1]);
    EXPECT_EQ(point.hasTip(), missing.what != "tip");
    EXPECT_EQ(points.tips(), missing.what == "tip" ? 0U : kCount);
    EXPECT_EQ(has_sd, missing.what == "surface");
    EXPECT_EQ(std::isnan(point.surface_mm[0]), missing.what != "sd");
    return std::string{missing.what} + ": " + why;
  };
  using D = messages::Descriptor;
  EXPECT_THAT(lacking([](D& d) { d.delay = {}; }), testing::AllOf(HasSubstr("tip: "), HasSubstr("delay")));
  EXPECT_THAT(lacking([](D& d) { d.tip.referenced = 5; }), testing::AllOf(HasSubstr("tip: "), HasSubstr("of Y")));
  EXPECT_THAT(lacking([](D& d) { d.tip.screws_unknown = 4; }), testing::AllOf(HasSubstr("tip: "), HasSubstr("of Z")));
  EXPECT_THAT(lacking([](D& d) { d.tip.turned = true; }), testing::AllOf(HasSubstr("tip: "), HasSubstr("turned")));
  EXPECT_THAT(lacking([](D& d) { d.tip.has_deflection = false; }),
              testing::AllOf(HasSubstr("tip: "), HasSubstr("deflections")));
  EXPECT_THAT(lacking([](D& d) { d.tip = {}; }), HasSubstr("pack"));
  EXPECT_THAT(lacking([](D& d) { d.channels[4].name = "y"; }),
              testing::AllOf(HasSubstr("tip: "), HasSubstr("position_y")));
  EXPECT_THAT(lacking([](D&) {}, 16), testing::AllOf(HasSubstr("tip: "), HasSubstr("range")));
  EXPECT_THAT(lacking([](D& d) { d.tip.gain_result_id = 0; }),
              testing::AllOf(HasSubstr("sd: "), HasSubstr("gain"), HasSubstr("probe.toml")));
  EXPECT_THAT(lacking([](D& d) { d.tip.noise_nm = 0; }), testing::AllOf(HasSubstr("sd: "), HasSubstr("noise")));
  EXPECT_THAT(lacking([](D& d) { d.tip.ball_radius_mm = 0; }),
              testing::AllOf(HasSubstr("surface: "), HasSubstr("radius")));
}

// What a warm screw adds is between the encoder and the tool.
TEST(TipPoints, TakeTheScrewOut) {
  std::mt19937_64 random{5};
  const Scan scan;
  const auto columns = scan.columns(random);
  auto descriptor = scanning();
  TipPoints cold{0.2}, warm{0.2};
  const auto before = cold.of({descriptor, header(), columns}, 9);
  descriptor.tip.screws = 1;
  descriptor.tip.screw_mm = {0.02, 0, 0};
  descriptor.tip.screw_slope = {1e-4, 0, 0};
  const auto after = warm.of({descriptor, header(), columns}, 9);
  const double machine_mm = 1e-6 * static_cast<double>(columns[3 * kCount + 9]);
  EXPECT_NEAR(before.tip_mm[0] - after.tip_mm[0], 0.02 + 1e-4 * machine_mm, 1e-9);
  EXPECT_EQ(before.tip_mm[1], after.tip_mm[1]);
  EXPECT_GT(after.sd_tip_mm[0], before.sd_tip_mm[0]);
}

// Within the reach of the motion's direction the ball was in the air: the normal would be that of a swing.
TEST(TipPoints, GiveNoSurfaceWhereTheBallLeavesIt) {
  std::mt19937_64 random{7};
  auto descriptor = scanning();
  descriptor.tip.offset_mm = Scan{}.offset_mm;
  for (const double swing_mm : {0.0, 0.03}) {
    Scan leaving;
    leaving.lifts_at_s = 20 * kPeriod_s;
    leaving.swing_mm = swing_mm;
    const auto columns = leaving.columns(random);
    TipPoints points{0.2};
    const link::DecodedBlock block{descriptor, header(), columns};
    std::uint64_t given = 0;
    for (std::size_t k = 0; k < kCount; ++k) {
      const auto& point = points.of(block, k);
      if (std::isnan(point.surface_mm[0])) continue;
      ++given;
      const double off = std::hypot(point.surface_mm[0], point.surface_mm[1], point.surface_mm[2]) - kSphere_mm;
      EXPECT_LT(std::abs(off), 5 * point.sd_along_normal_mm) << k << ": " << off;
    }
    EXPECT_GE(given, 10U);
    EXPECT_EQ(given, points.surfaces());
    ASSERT_FALSE(points.missing().empty());
    for (const auto& [why, missing] : points.missing()) EXPECT_EQ(missing.what, "surface") << why;
  }
}

// A stylus in the air touches nothing; one that swings along its own deflection slides along no surface.
TEST(TipPoints, GiveNoSurfaceInTheAir) {
  std::mt19937_64 random{6};
  const auto descriptor = scanning();
  Scan free;
  free.deflection_mm = 0.005;
  const auto columns = free.columns(random);
  TipPoints points{0.2};
  EXPECT_TRUE(points.of({descriptor, header(), columns}, 30).hasTip());
  EXPECT_EQ(points.surfaces(), 0U);
  EXPECT_TRUE(points.missing().empty());
}

}  // namespace
}  // namespace probebox::command
