#pragma once
#include <optional>
#include <span>
#include <vector>

#include "firmware/metrology/fit/line.hpp"

// Noise of a signal that ought to stand still, from many short windows of it.
namespace probebox::metrology {

// Samples of one window: times rise, values have one row a sample.
struct StillWindow {
  std::vector<double> times;  // s
  Rows3 values;               // mm
};

struct NoiseAtRest {
  Eigen::Vector3d sd_mm;
  Eigen::Vector3d sd_of_sd_mm;  // from the scatter of the windows: neighbours may be alike
};
// About the mean of each window. Nothing for fewer than three windows.
std::optional<NoiseAtRest> noiseAtRest(std::span<const StillWindow> windows);

// A sine of one frequency and amplitude in all windows, with a phase of its own in each.
struct NoiseLine {
  double frequency_hz{};  // between zero and half of the rate of the samples
  double sd_frequency_hz{};
  double amplitude_mm{};  // of the vector
  double sd_amplitude_mm{};
  double rate_hz{};  // of the samples: a line of rate - frequency, or rate + frequency, looks the same
};
// The strongest one that stands out from what is left and from the frequencies beside it.
std::optional<NoiseLine> noiseLine(std::span<const StillWindow> windows);

}  // namespace probebox::metrology
