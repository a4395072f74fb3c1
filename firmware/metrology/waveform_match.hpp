#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset.hpp"
#include "firmware/metrology/result.hpp"
#include "firmware/metrology/signal.hpp"
#include "protocol/units/outcome.hpp"

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
struct SeenTwice {
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

struct Match {
  double tau_s{};
  double sd_s{};
  double rms_mm{};       // of e
  double expected_mm{};  // what the noise of the samples promises for it
  std::size_t dof{};
  double condition{};                // of the column-scaled Jacobian of e
  std::vector<std::string> dropped;  // stretches of time, by name, in which e lies beyond 4.5 deviations
  double dropped_share{};
  Residuals residuals;  // e against the machine's time; every so many, so that a picture needs no more than 600
};

// The tau that settles e(t) = q(t) + g d(t - tau) - b . shapes(t), by the instrumental step of CN101622513
// (docs/metrology.md (A14), (A16), (A17), (A19)): Z'e = 0 with the shapes as instruments Z, because interpolating a
// noisy deflection changes its noise with the fraction between the samples, which draws least squares to whole ones. g
// and b belong to each record, tau to all; a record weighs as much as it tells. Both signals are interpolated onto one
// grid as fine as the finer of them. start: s, to within a few samples. Refuses: gap (more than 2.5 periods between
// samples), too-few-samples, ill-conditioned, no-convergence.
Outcome<Match, Refusal> matchWaveforms(std::span<const SeenTwice> records, double start, Interpolation interpolation);

// Refuses residual-too-large: rms above three times what the noise promises, or more dropped than this share.
std::optional<Refusal> poorMatch(const Match& match, double dropped_share);

// The sd; where residuals are larger than the noise promises by one deviation of theirs, it grows with them.
double widenedSd(const Match& match);

// The answer of a method that matches waveforms: tau_s on top of the delay that the stamps were corrected by. A warning
// where the residuals are worse than the noise promises by more than two fifths.
Result reportMatch(const Dataset& dataset, const Match& match, const Eigen::VectorXd& previous,
                   std::span<const std::string_view> keys);

}  // namespace probebox::metrology
