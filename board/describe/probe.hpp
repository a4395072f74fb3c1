#pragma once
#include <array>
#include <string>

// Describes the probe and its stylus, from the maker or from the last qualification (probe.toml).
namespace probebox::board {

using Matrix3 = std::array<std::array<double, 3>, 3>;  // rows

struct Certificate {
  std::string number;
  std::string date;  // ISO 8601, metadata only
};

struct Probe {
  std::string serial_number;
  Matrix3 gain{};     // mm of deflection in machine axes per mm of channels a, b, c: (A3)
  double rate_hz{};   // nominal sample rate
  double noise_um{};  // standard deviation (k = 1) of one sample of one channel
  double deflection_limit_mm{};
  double ball_diameter_mm{};  // stylus ball
  Certificate certificate;    // empty when none is known
};

}  // namespace probebox::board
