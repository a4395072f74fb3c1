#pragma once
#include <span>

#include "firmware/metrology/touch/touch.hpp"

namespace probebox::metrology {

// Jitter of the stamps of either stream, s (k = 1). It acts as noise of moving channels, proportional to the speed.
struct StampJitter {
  double machine_s{};
  double probe_s{};
};

// Estimates it robustly from the retracts of all touches together: deviation of a sample from the line between its
// neighbours, beyond the stream's noise at rest. One touch moves for too few samples to separate jitter from slip. At
// most 0.3 ms.
StampJitter stampJitter(std::span<const Touch> touches);

// Resolution of each channel's encoder or converter, 0 if there is none.
Eigen::Vector3d stepsOf(const Stream& stream);

// sd of one sample of a stream along a direction, from its whole record, because a window has too few samples to
// separate noise from a ramp. At least the quantisation noise.
double noiseOf(const Stream& stream, const Eigen::Vector3d& direction);

}  // namespace probebox::metrology
