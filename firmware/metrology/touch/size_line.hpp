#pragma once
#include <optional>
#include <span>

#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// A size measured at one speed.
struct SizeAtSpeed {
  double normal_speeds_mm_s{};  // sum of the outward-normal velocities of the touches that make the size: 2 S for a
                                // diameter on retract from an external feature, -2 S on approach, -2 S for an internal
                                // gap on retract
  double size_mm{};
  double variance{};  // mm^2
};

struct SizeLine {
  double tau_s{};
  double size_mm{};  // D0, corrected by the delay; D0 minus the known size is the static error
  double tau_variance{};
  double size_variance{};
  double covariance{};    // tau with size, s mm
  double chi2_reduced{};  // 0 for two speeds
};

// Refuses single-speed and speeds-too-close (span under 20 % of the fastest); nullopt when the speeds separate delay
// and size.
std::optional<Refusal> refuseSpeeds(double least, double greatest);

// Fits D = D0 - tau * normal_speeds by weighted least squares (CN101622513, docs/metrology.md (A10)). Refuses what
// refuseSpeeds refuses.
Outcome<SizeLine, Refusal> fitSizeLine(std::span<const SizeAtSpeed> sizes);

// Delay from a known size (A9), by weighted least squares: tau = (size - D) / normal speeds, s.
double delayOfKnownSize(double size_mm, std::span<const SizeAtSpeed> sizes);

}  // namespace probebox::metrology
