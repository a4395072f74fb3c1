#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/retract.hpp"

namespace probebox::metrology {

// Variance of one sample of a stream, along the motion and in each direction across it. Stamp jitter acts along the
// motion and grows with the speed.
struct SampleNoise {
  double along{};
  double across{};
  // Factors on the variances of mean and slope of a line through these samples: above 1 where neighbours are
  // correlated.
  double of_mean{1.0};
  double of_slope{1.0};
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

// Samples of the machine as recorded, or relative to an interpolated stream, which correlates neighbours by itself.
enum class Neighbours { recorded, interpolated };

// Noise of every touch from the residuals of its lines, pooled over all touches, with the part of quantisation in
// residuals and in lines separated, and correlation of neighbouring samples accounted for. dof: of all pooled
// residuals; least_dof: of the stream with fewer.
struct PooledNoise {
  std::vector<TouchNoise> of_touch;
  std::size_t dof{};
  std::size_t least_dof{};
  std::vector<std::string> warnings{};  // of clearly correlated samples
};
PooledNoise poolNoise(std::span<const Retract> retracts, Neighbours neighbours = Neighbours::recorded);

// Refuses too-few-samples: fewer than six residuals of either stream in all touches together.
std::optional<Refusal> tooFewResiduals(std::span<const Retract> retracts);

// Names of the touches with residuals more than three times those of the others at their speed: slip or bounce.
std::vector<Dropped> noisyTouches(std::span<const Retract> retracts);

}  // namespace probebox::metrology
