#pragma once
#include <cstddef>
#include <span>
#include <vector>

#include "firmware/metrology/result.hpp"
#include "firmware/metrology/retract.hpp"

namespace probebox::metrology {

// Variance of one sample of a stream, along the motion and in either direction across it. Jitter of the stamps appears
// along the motion, and grows with the speed.
struct SampleNoise {
  double along{};
  double across{};
};
struct TouchNoise {
  SampleNoise machine;  // mm^2
  SampleNoise probe;    // raw^2
};

// Noise of every touch from the residuals of its lines, pooled over all touches. dof: of the residuals that were
// pooled, all together.
struct PooledNoise {
  std::vector<TouchNoise> of_touch;
  std::size_t dof{};
};
PooledNoise poolNoise(std::span<const Retract> retracts);

// Names of the touches whose own residuals are more than three times those of the others at its speed: slip or bounce.
std::vector<Dropped> noisyTouches(std::span<const Retract> retracts);

}  // namespace probebox::metrology
