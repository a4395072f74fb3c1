#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/fit/robust_statistics.hpp"

namespace probebox::metrology {

// Equal steps of machine time, and what the machine shows there.
struct Grid {
  Eigen::VectorXd times;  // s
  Eigen::VectorXd q;      // mm
  double step{};          // s
};

// What an encoder's steps do to q where they are coarse: more than noise that every sample has for itself.
struct RoundedMotion {
  double own{};     // variance that a sample has for itself, mm^2
  double common{};  // variance of a sample that it shares with others
  // Variance that the common part gives a sum over the machine's samples, one gain a sample.
  std::function<double(const Eigen::VectorXd& gains)> of_sum;
};

// The same motion seen twice: by the machine as q (mm), and by the probe as a deflection (raw or mm).
struct WaveformPair {
  std::string name;
  const Signal* machine{};  // they outlive what compares them
  const Signal* probe{};
  double from{};  // machine time between which the two are compared: samples of both on either side
  double until{};
  // Columns, one row a point of the grid: the rate of q or what has its shape, then the shape of q itself, then 1 and
  // further shapes that q may be off by. The first may depend on q only as the rate of a smooth does (antisymmetric in
  // time, equal all over the grid), the second as a smooth does: then the noise of q takes no side.
  std::function<Eigen::MatrixXd(const Grid& grid)> shapes;
  // Machine time that is left out, as [from, until], in rising order: gaps, and kinks that interpolation cannot follow.
  std::vector<std::pair<double, double>> skipped{};
  std::optional<RoundedMotion> rounded{};
};

}  // namespace probebox::metrology
