#pragma once
#include <Eigen/Core>
#include <functional>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"
#include "firmware/metrology/scan/block_squares.hpp"
#include "firmware/metrology/scan/waveform_pair.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

struct Match {
  double tau_s{};
  double sd_s{};
  double rms_mm{};                   // of e
  double expected_mm{};              // expected rms from the noise of the samples
  NeighbourCorrelation correlation;  // of e, beyond what interpolation correlates
  std::size_t dof{};
  double condition{};                // of the column-scaled Jacobian of e
  std::vector<std::string> dropped;  // names of time ranges in which e exceeds 4.5 sd
  double dropped_share{};
  Residuals residuals;  // e over machine time, thinned to at most 600 points for a plot
};

// Finds tau with e(t) = q(t) + g d(t - tau) - b . shapes(t) by the instrumental step of CN101622513 (docs/metrology.md
// (A14), (A16), (A17), (A19)): Z'e = 0 with the shapes as instruments Z. Interpolating a noisy deflection changes its
// noise with the fraction between samples, which would bias least squares to whole samples. g and b belong to each
// record, tau to all; records are weighted by their information. Both signals are interpolated onto the finer grid.
// start: s, within a few samples. Refuses: gap (more than 2.5 periods), too-few-samples, ill-conditioned,
// no-convergence.
Outcome<Match, Refusal> matchWaveforms(std::span<const WaveformPair> records, double start,
                                       Interpolation interpolation);

// Refuses residual-too-large: rms above three times the expected one, or a larger fraction dropped than this.
std::optional<Refusal> poorMatch(const Match& match, double dropped_share);

// The sd, widened when the residuals exceed the expected ones by one sd of theirs, and for correlated samples.
double widenedSd(const Match& match);

// Result of a method that matches waveforms: tau_s in addition to the previous delay. Warns when the residuals exceed
// the expected ones by more than two fifths, and of clearly correlated samples.
Result reportMatch(const Dataset& dataset, const Match& match, const Eigen::VectorXd& previous);

}  // namespace probebox::metrology
