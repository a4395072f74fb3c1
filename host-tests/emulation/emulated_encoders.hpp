#pragma once
#include <array>
#include <memory>
#include <optional>
#include <random>
#include <span>

#include "drivers/counter/counter_source.hpp"
#include "drivers/counter/emulator.hpp"
#include "drivers/gpio/quadrature.hpp"
#include "drivers/gpio/quadrature_emulator.hpp"
#include "drivers/world/world.hpp"
#include "firmware/box/box.hpp"

namespace probebox::scenario {

// How the counts of the world's axes reach the box: stamped by the world, or by the drivers of encoders through their
// emulators.
enum class EncodersAre {
  stamped,
  polled,    // a counter device each: of 16 bits, of 32, and one with a ceiling of its own
  latched,   // the same, latched by the sync line
  on_lines,  // X and Y polled, Z latched, and the part spindle C on two gpio lines
};

// The world's axes behind counter devices and gpio lines, read by the drivers that a real box has.
class EmulatedEncoders {
 public:
  // The kernel stamps a latch so much after it.
  static constexpr Nanoseconds kStampLateness = std::chrono::microseconds{6};
  static constexpr double kCountsPerDegree = 10;  // of the lines on the part spindle

  EmulatedEncoders(EncodersAre kind, const world::World& world, const world::Config& config);

  // What a box must know about them.
  static void describe(EncodersAre kind, box::BoxConfig& box);

  // True for counts of the world that these replace.
  bool replaces(const Event& event) const;
  // A tick of the master clock, when it really was.
  void latch(MonoTime at);
  // What has come by `now`, which goes on in steps of a millisecond.
  std::size_t read(std::span<Event> into, MonoTime now);

  counter::EmulatedCounter& counter(std::size_t axis) { return *devices_.at(axis); }
  const counter::CounterSource& source(std::size_t axis) const { return *counters_.at(axis); }
  gpio::EmulatedQuadrature& lines() { return *lines_; }
  const gpio::QuadratureSource& quadrature() const { return *quadrature_; }

  // Wrong wiring, from now on.
  void exchangeAxes(std::size_t one, std::size_t other) { std::swap(wired_to_.at(one), wired_to_.at(other)); }
  void exchangeLines(std::size_t axis) { turns_.at(axis) = -turns_.at(axis); }

 private:
  bool isLatched(std::size_t axis) const;
  std::int64_t countsAt(std::size_t input, MonoTime at);

  EncodersAre kind_;
  const world::World& world_;
  world::Config config_;
  std::mt19937_64 random_{5};
  std::array<std::size_t, kLinearAxes> wired_to_{0, 1, 2};
  std::array<int, kLinearAxes> turns_{1, 1, 1};
  std::array<counter::EmulatedCounter*, kLinearAxes> devices_{};
  std::array<std::unique_ptr<counter::CounterSource>, kLinearAxes> counters_;
  gpio::EmulatedQuadrature* lines_{};
  std::unique_ptr<gpio::QuadratureSource> quadrature_;
  MonoTime turned_until_{};
};

}  // namespace probebox::scenario
