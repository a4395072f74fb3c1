#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/retract.hpp"

namespace probebox::metrology {

// Variance of one sample of a stream, along the motion and in either direction across it. Jitter of the stamps appears
// along the motion, and grows with the speed.
struct SampleNoise {
  double along{};
  double across{};
};
// What rounding moves the machine's line by beside that, each axis for itself; mm^2 and s.
struct LineNoise {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  Eigen::Vector3d both = Eigen::Vector3d::Zero();

  // Of the line at `lever` seconds from its mean.
  Eigen::Vector3d at(double lever) const { return mean + 2.0 * lever * both + lever * lever * slope; }
};
struct TouchNoise {
  SampleNoise machine;  // mm^2
  SampleNoise probe;    // raw^2
  LineNoise rounded{};
};

// Noise of every touch from the residuals of its lines, pooled over all touches; what the encoder's steps leave in the
// residuals is told apart from what they move the lines by. dof: of the residuals that were pooled, all together;
// least_dof: of the stream that has fewer.
struct PooledNoise {
  std::vector<TouchNoise> of_touch;
  std::size_t dof{};
  std::size_t least_dof{};
};
PooledNoise poolNoise(std::span<const Retract> retracts);

// Refuses too-few-samples: fewer than six residuals of either stream in all touches together tell no noise.
std::optional<Refusal> tooFewResiduals(std::span<const Retract> retracts);

// Names of the touches whose own residuals are more than three times those of the others at its speed: slip or bounce.
std::vector<Dropped> noisyTouches(std::span<const Retract> retracts);

}  // namespace probebox::metrology
