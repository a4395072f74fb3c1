#pragma once
#include <array>
#include <chrono>
#include <cmath>
#include <optional>

#include "firmware/corrections/corrections.hpp"

namespace probebox::corrections {

using std::chrono::milliseconds;

// A machine with three linear axes, rotary ones where it has any, one heating screw and a controller that adds what it
// is told, around the corrections: time goes on in ticks of a millisecond, and the CNC reads every ten of them.
class MachineOnADesk {
 public:
  static constexpr double kMmPerCount = 1e-6;
  static constexpr double kDegPerCount = 1e-5;

  static CorrectionsConfig usual() {
    CorrectionsConfig config;
    for (auto& reference : config.references) reference = {.by = ReferenceBy::homing, .mm_per_count = kMmPerCount};
    for (auto& limit : config.limits) limit = {.size_mm = 0.2, .rate_mm_s = 0.05};
    config.screws[0].fitted = true;
    config.screws[0].model.length_mm = 800;
    config.screws[0].model.offset_mm = 100;
    config.screws[0].model.pitch_mm = 10;
    config.screws[0].model.gain = -1;
    config.screws[0].model.threshold_rpm = 60;
    config.screws[0].limits = {.least_extension_um = -50, .greatest_extension_um = 300, .rate_um_s = 1e6};
    config.screws[0].hold = std::chrono::seconds{2};
    config.centreline.hold = std::chrono::seconds{2};
    config.mask = bitOf(SourceKind::screw);
    return config;
  }

  explicit MachineOnADesk(const CorrectionsConfig& config) : corrections{config}, config_{config} {}

  // Advances one tick. Inputs that are switched off are not delivered.
  void tick() {
    now += milliseconds{1};
    ++ticks_;
    latch::Record record;
    record.index = {ticks_};
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
      const auto counts = std::llround(position_mm[axis] / kMmPerCount) + power_up;
      record.values[static_cast<std::size_t>(latch::Channel::x) + axis] = counts;
      if (encoders) corrections.push(Count{static_cast<Axis>(axis), static_cast<std::uint32_t>(ticks_), counts, now});
    }
    for (std::size_t axis = 0; axis < kRotaryAxes; ++axis) {
      if (!angle_deg[axis]) continue;
      const auto counts = std::llround(*angle_deg[axis] / kDegPerCount) + power_up;
      corrections.push(AngleCount{static_cast<RotaryAxis>(axis), static_cast<std::uint32_t>(ticks_), counts, now});
    }
    if (sensor && ticks_ % 100 == 0)
      corrections.push(Drift{Axis::x, static_cast<std::int32_t>(std::lround(extension_um * 1e3)), now});
    if (encoders && clock && probe) corrections.tick(record, now);
    if (published && ticks_ % 10 == 0) corrections.advance(now, map(), {});
  }
  void run(double seconds) {
    for (int i = 0; i < std::lround(seconds * 1000); ++i) tick();
  }
  void home() {
    for (std::size_t axis = 0; axis < kLinearAxes; ++axis)
      corrections.push(AxisHomed{static_cast<Axis>(axis), position_mm[axis], now});
  }
  // Ideal correction of X for the screw at present.
  double wanted_x_mm() const { return -(position_mm[0] + 100) / 800 * extension_um * 1e-3; }
  const published::CorrectionsState& snapshot() const { return corrections.state(); }

  Corrections corrections;
  MonoTime now{monoTime(1'000'000'000)};
  Vector position_mm{300, 50, -100};
  std::array<std::optional<double>, kRotaryAxes> angle_deg{};  // by encoder; nothing: no encoder, or it is silent
  double extension_um{};
  bool sensor{true}, encoders{true}, clock{true}, probe{true};
  bool published{true};  // false: the computer is busy elsewhere
  std::int64_t power_up{777'000};

 private:
  TickMap map() const {
    return {.tick = {ticks_},
            .at = now,
            .period_q32_ns = std::int64_t{1'000'000} << 32,
            .sigma_ns = 300,
            .state = clock ? ClockState::locked : ClockState::unlocked,
            .holdover_ms = 0};
  }

  CorrectionsConfig config_;
  std::int64_t ticks_{};
};

}  // namespace probebox::corrections
