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
#include "firmware/metrology/scan/waveform_pair.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

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
Outcome<Match, Refusal> matchWaveforms(std::span<const WaveformPair> records, double start,
                                       Interpolation interpolation);

// Refuses residual-too-large: rms above three times what the noise promises, or more dropped than this share.
std::optional<Refusal> poorMatch(const Match& match, double dropped_share);

// The sd; where residuals are larger than the noise promises by one deviation of theirs, it grows with them.
double widenedSd(const Match& match);

// The answer of a method that matches waveforms: tau_s on top of the delay that the stamps were corrected by. A warning
// where the residuals are worse than the noise promises by more than two fifths.
Result reportMatch(const Dataset& dataset, const Match& match, const Eigen::VectorXd& previous,
                   std::span<const std::string_view> keys);

}  // namespace probebox::metrology
