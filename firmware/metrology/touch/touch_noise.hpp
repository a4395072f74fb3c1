#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/retract.hpp"

namespace probebox::metrology {

// Variance of one sample of a stream, along the motion and in each direction across it. Stamp jitter acts along the
// motion and grows with the speed.
struct SampleNoise {
  double along{};
  double across{};
};
// Additional variance of the machine's line due to quantisation, per axis; mm^2 and s.
struct LineNoise {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  Eigen::Vector3d both = Eigen::Vector3d::Zero();

  // Variance of the line at `lever` seconds from its mean.
  Eigen::Vector3d at(double lever) const { return mean + 2.0 * lever * both + lever * lever * slope; }
};
struct TouchNoise {
  SampleNoise machine;  // mm^2
  SampleNoise probe;    // raw^2
  LineNoise rounded{};
};

// Noise of every touch from the residuals of its lines, pooled over all touches, with the part of quantisation in
// residuals and in lines separated. dof: of all pooled residuals; least_dof: of the stream with fewer.
struct PooledNoise {
  std::vector<TouchNoise> of_touch;
  std::size_t dof{};
  std::size_t least_dof{};
};
PooledNoise poolNoise(std::span<const Retract> retracts);

// Refuses too-few-samples: fewer than six residuals of either stream in all touches together.
std::optional<Refusal> tooFewResiduals(std::span<const Retract> retracts);

// Names of the touches with residuals more than three times those of the others at their speed: slip or bounce.
std::vector<Dropped> noisyTouches(std::span<const Retract> retracts);

}  // namespace probebox::metrology
