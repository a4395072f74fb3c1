#pragma once
#include <span>

#include "firmware/metrology/touch/touch.hpp"

namespace probebox::metrology {

// How much the stamps of either stream jitter, s (k = 1). It shows as noise of what moves, in proportion to its speed.
struct StampJitter {
  double machine_s{};
  double probe_s{};
};

// From the retracts of all touches together, robust: what a sample misses the line between its neighbours by, beyond
// what the stream's own noise at rest explains. One touch alone moves for too few samples to tell noise from a slip.
// Never above 0.3 ms: what looks like more is no jitter.
StampJitter stampJitter(std::span<const Touch> touches);

// Of the encoder or converter of each channel, 0 where there are none.
Eigen::Vector3d stepsOf(const Stream& stream);

// Deviation of one sample of a stream along a direction, as its whole record tells it: a window alone holds too few to
// tell noise from a ramp. Not below what the steps of the encoder or converter leave.
double noiseOf(const Stream& stream, const Eigen::Vector3d& direction);

}  // namespace probebox::metrology
