#pragma once
#include <array>
#include <cmath>
#include <cstdint>
#include <span>
#include <variant>
#include <vector>

#include "drivers/world/world.hpp"

// What the tests of the emulated machine share: its streams taken apart, and simple statistics of their own.
namespace probebox::world::testing {

inline MonoTime seconds(double s) {
  return MonoTime{Nanoseconds{std::llround(s * 1e9)}};
}

struct Streams {
  std::vector<Edge> edges;
  std::vector<Deflection> deflections;
  std::array<std::vector<Count>, 3> counts;
  std::vector<AngleCount> angles;

  void add(const Event& event) {
    if (const auto* edge = std::get_if<Edge>(&event)) edges.push_back(*edge);
    if (const auto* deflection = std::get_if<Deflection>(&event)) deflections.push_back(*deflection);
    if (const auto* angle = std::get_if<AngleCount>(&event)) angles.push_back(*angle);
    if (const auto* count = std::get_if<Count>(&event)) counts[static_cast<std::size_t>(count->axis)].push_back(*count);
  }
};

// Hands over all that has happened, some events at a time.
template <class Take>
void handOver(World& world, const Take& take, std::size_t chunk = 64) {
  std::vector<Event> some(chunk);
  for (std::size_t n = world.poll(some); n > 0; n = world.poll(some)) take(std::span{some}.first(n));
}

inline void pollAll(World& world, std::vector<Event>& into, std::size_t chunk = 64) {
  handOver(
      world, [&](std::span<const Event> some) { into.insert(into.end(), some.begin(), some.end()); }, chunk);
}

inline Streams takeApart(const std::vector<Event>& events) {
  Streams streams;
  for (const Event& event : events) streams.add(event);
  return streams;
}

// All of a world's events at once take more time in the kernel, for their pages, than in the test.
inline Streams run(World& world, double until_s) {
  Streams streams;
  world.advanceTo(seconds(until_s));
  handOver(world, [&](std::span<const Event> some) {
    for (const Event& event : some) streams.add(event);
  });
  return streams;
}

// A machine with a datum sphere and a scanning probe, whose clock and sensors are a little noisy.
inline Config usual() {
  Config config;
  config.delays = {.tau_machine_s = {0.0042, 0.0042, 0.0042}, .tau_probe_s = 0.00035};
  config.clock = {.period_ns = 1'000'000,
                  .drift_ppm = 12,
                  .wander_ppm = 0.002,
                  .bias_us = 15,
                  .jitter = Jitter::lognormal,
                  .jitter_us = 10,
                  .outlier_probability = 0.005,
                  .outlier_us = 80};
  config.encoders = {.rate_hz = 500, .noise_um = 0.5, .counts_per_mm = 1e6};
  config.axes = {.acceleration_mm_s2 = 10'000, .traverse_mm_s = 300, .home_mm = {10, -20, 110}};
  config.probe = {.rate_hz = 1000,
                  .noise_um = 0.4,
                  .gain = {{{0.98, 0.01, -0.005}, {-0.012, 1.03, 0.004}, {0.006, -0.008, 1.01}}},
                  .range_mm = 1.2,
                  .bounce_mm = 0.02,
                  .bounce_decay_s = 0.004,
                  .friction = 0.08};
  config.sphere = {.centre_mm = {10, -20, 30}, .radius_mm = 12.5, .stylus_ball_radius_mm = 3};
  config.cycle.dwell_s = 0.1;
  config.trigger_line = false;
  return config;
}

// The same, in which nothing is random but what a test switches on.
inline Config quiet() {
  Config config = usual();
  config.clock.drift_ppm = 0;
  config.clock.wander_ppm = 0;
  config.clock.bias_us = 0;
  config.clock.jitter = Jitter::none;
  config.clock.outlier_probability = 0;
  config.encoders.noise_um = 0;
  config.probe.noise_um = 0;
  config.probe.bounce_mm = 0;
  return config;
}

struct Line {
  double intercept{}, slope{};
};

inline Line fitLine(std::span<const double> x, std::span<const double> y) {
  double mean_x = 0, mean_y = 0, xx = 0, xy = 0;
  for (const double value : x) mean_x += value / static_cast<double>(x.size());
  for (const double value : y) mean_y += value / static_cast<double>(y.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    xx += (x[i] - mean_x) * (x[i] - mean_x);
    xy += (x[i] - mean_x) * (y[i] - mean_y);
  }
  return {mean_y - xy / xx * mean_x, xy / xx};
}

struct Moments {
  double mean{}, sd{};
};

inline Moments momentsOf(std::span<const double> values) {
  Moments m;
  for (const double value : values) m.mean += value / static_cast<double>(values.size());
  for (const double value : values) m.sd += (value - m.mean) * (value - m.mean);
  m.sd = std::sqrt(m.sd / static_cast<double>(values.size() - 1));
  return m;
}

}  // namespace probebox::world::testing
