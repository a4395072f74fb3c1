#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>

#include "protocol/units/outcome.hpp"

namespace probebox::tour {

// True values of the emulated machine, which the box has to measure.
struct Truth {
  double tau_s{};
  double effective_diameter_mm{};  // datum sphere and stylus ball
  double drift_ppm{};
  std::array<double, 2> centre_mm{};  // of the part's axis C at the height of the first ball, X Y
};

// Writes a world.toml with delays and a place of the part's axis drawn from `seed`, and with sensors that lose samples
// now and then. Everything else is the emulated board's own.
Outcome<Truth> writeWorld(const std::filesystem::path& folder, std::uint64_t seed);

}  // namespace probebox::tour
