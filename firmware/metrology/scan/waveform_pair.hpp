#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/fit/robust_statistics.hpp"

namespace probebox::metrology {

// Equidistant machine times, and the machine's signal there.
struct Grid {
  Eigen::VectorXd times;  // s
  Eigen::VectorXd q;      // mm
  double step{};          // s
};

// Effect of coarse encoder quantisation on q: more than independent noise of each sample.
struct RoundedMotion {
  double own{};     // variance that a sample has for itself, mm^2
  double common{};  // covariance of a sample with the others
  // Variance that the common part adds to a weighted sum over the machine's samples; one gain per sample.
  std::function<double(const Eigen::VectorXd& gains)> of_sum;
};

// The same motion recorded twice: by the machine as q (mm), and by the probe as a deflection (raw or mm).
struct WaveformPair {
  std::string name;
  const Signal* machine{};  // must outlive the pair
  const Signal* probe{};
  double from{};  // range of machine time for the comparison: both have samples on either side
  double until{};
  // Columns, one row per grid point: the rate of q, the shape of q itself, then 1 and further shapes of possible errors
  // of q. Build column 1 from a smoothed q, so the instruments are uncorrelated with the noise of q: antisymmetric in
  // time and equal over the grid; column 2 likewise, symmetric.
  std::function<Eigen::MatrixXd(const Grid& grid)> shapes;
  // Omitted machine times, as increasing [from, until]: gaps, and kinks that interpolation cannot follow.
  std::vector<std::pair<double, double>> skipped{};
  std::optional<RoundedMotion> rounded{};
};

}  // namespace probebox::metrology
