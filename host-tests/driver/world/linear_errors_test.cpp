#include <gtest/gtest.h>
#include <numbers>

#include "streams.hpp"

// The linear axes carry the body beside where their encoders say, by errors named as in ISO 230-1.
namespace probebox::world {
namespace {

using testing::quiet;
using testing::run;
using testing::seconds;

Config askew() {
  Config config = quiet();
  config.linear_axes.scale = {20e-6, 0, -10e-6};
  config.linear_axes.squareness_rad = {3e-5, -4e-5, 5e-5};
  config.linear_axes.waves[0][1] = {.amplitude_mm = 0.002, .length_mm = 80, .phase_rad = 0.5};
  return config;
}

TEST(LinearErrors, HaveTheSignsOfISO230) {
  const Machine machine{askew()};
  const auto error = [&](const Vector3& position) { return machine.bodyFor(position) - position; };
  const Vector3 origin = error({0, 0, 0});
  const auto change = [&](const Vector3& to) { return error(to) - origin; };
  const auto expect = [](const Vector3& found, const Vector3& wanted) {
    for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(found[i], wanted[i], 1e-12);
  };
  // EXX lengthens X; EYX bends it along Y.
  const double wave = 0.002 * (std::sin(2 * std::numbers::pi * 100 / 80 + 0.5) - std::sin(0.5));
  expect(change({100, 0, 0}), {0.002, wave, 0});
  // EC0Y turns Y about Z: towards -X. EB0Z turns Z about Y, towards +X, and EA0Z about X, towards -Y.
  expect(change({0, 100, 0}), {-0.005, 0, 0});
  expect(change({0, 0, 100}), {-0.004, -0.003, -0.001});
}

TEST(LinearErrors, MoveWhatIsTouchedAndNotWhatTheEncodersSay) {
  const Config straight = quiet(), bent = askew();
  World ideal{straight, 1}, real{bent, 1};
  const double reach_mm = straight.sphere.radius_mm + straight.sphere.stylus_ball_radius_mm;
  for (World* world : {&ideal, &real}) {
    Machine& machine = world->machine();
    ASSERT_TRUE(machine.moveTo(straight.sphere.centre_mm + Vector3{reach_mm + 2, 0, 0}, 50, seconds(1)));
    ASSERT_TRUE(machine.moveTo(straight.sphere.centre_mm + Vector3{reach_mm - 0.5, 0, 0}, 20, seconds(20)));
  }
  const auto from_ideal = run(ideal, 30), from_real = run(real, 30);
  ASSERT_EQ(from_ideal.counts[0].size(), from_real.counts[0].size());
  for (std::size_t i = 0; i < from_real.counts[0].size(); i += 100)
    EXPECT_EQ(from_real.counts[0][i].counts, from_ideal.counts[0][i].counts);
  // The body is at the surface when its stylus touches, and its deflection is as deep as the body goes beyond.
  const auto* contact = real.machine().stylus().contact(0);
  ASSERT_NE(contact, nullptr);
  EXPECT_NEAR(norm(contact->point - straight.sphere.centre_mm), reach_mm, 1e-9);
  const MonoTime after = seconds(29);
  const Vector3 body = real.machine().bodyAt(after);
  const Vector3 pushed = real.machine().stylusDisplacementAt(after);
  EXPECT_NEAR(norm(body + pushed - contact->point), 0, 1e-9);
  EXPECT_GT(std::abs(norm(pushed) - norm(ideal.machine().stylusDisplacementAt(after))), 1e-4) << "X is 20 um/m long";
}

}  // namespace
}  // namespace probebox::world
