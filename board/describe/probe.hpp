#pragma once
#include <array>
#include <optional>
#include <string>

#include "board/describe/keys.hpp"

// Describes the probe and its stylus, from the maker or from the last qualification (probe.toml).
namespace probebox::board {

using Matrix3 = std::array<std::array<double, 3>, 3>;  // rows

struct Certificate {
  std::string number;
  std::string date;

  static constexpr void keys(auto& self, auto&& key) {
    key("number", self.number, kAnyText.orUsual(), "of the certificate");
    key("date", self.date, kAnyText.orUsual(), "ISO 8601, metadata only");
  }
};

// The switch of a touch-trigger probe.
struct ProbeSwitch {
  std::string trigger;
  double repeatability_um{};

  static constexpr void keys(auto& self, auto&& key) {
    key("trigger", self.trigger, kAnyText, "name of its [[trigger]] in box.toml");
    key("repeatability_um", self.repeatability_um, within(1e-4, 1000), "of the depth at which it opens (k = 1)");
  }
};

// A probe that does not touch, and reads how far off a surface is along its axis.
struct ProbeDistance {
  double stand_off_mm{}, range_mm{};

  static constexpr void keys(auto& self, auto&& key) {
    key("stand_off_mm", self.stand_off_mm, within(0.01, 1000), "from its face to a surface in the middle of its range");
    key("range_mm", self.range_mm, within(0.3, 100), "of a reading, to either side of that");
  }
};

struct Probe {
  std::string serial_number;
  // For a touch-trigger probe, which has no channels: gain, rate and noise below then have no meaning.
  std::optional<ProbeSwitch> by_switch;
  // For a probe that does not touch: channel a is its distance, the gain has no meaning, and the ball has no size.
  std::optional<ProbeDistance> by_distance;
  Matrix3 gain{};
  double rate_hz{}, noise_um{}, deflection_limit_mm{}, ball_diameter_mm{};
  std::optional<double> sd_ball_diameter_mm;
  std::string stylus;       // its name, where styli are exchanged; empty: there is one
  Certificate certificate;  // empty when none is known

  // Results belong to probe and stylus together: those of one stylus do not hold for another.
  std::string name() const { return serial_number + (stylus.empty() ? "" : ", stylus " + stylus); }

  static constexpr void sampleKeys(auto& self, auto&& key) {
    key("rate_hz", self.rate_hz, within(10, 1e6), "nominal rate of the samples");
    key("noise_um", self.noise_um, within(1e-4, 1000), "of one sample of one channel (k = 1)");
  }
  static constexpr void channelKeys(auto& self, auto&& key) {
    sampleKeys(self, key);
    key("gain", self.gain, within(-1000, 1000),
        "mm of deflection in machine axes per mm of the channels a, b, c: (A3)");
  }
  static constexpr void limitKey(auto& self, auto&& key) {
    key("deflection_limit_mm", self.deflection_limit_mm, within(1e-3, 100), "that the probe bears");
  }
  static constexpr void stylusKeys(auto& self, auto&& key) {
    key("ball_diameter_mm", self.ball_diameter_mm, within(0.01, 100), "of the stylus ball");
    key("sd_ball_diameter_mm", self.sd_ball_diameter_mm, within(1e-6, 1), "of its diameter (k = 1)");
  }
};

}  // namespace probebox::board
