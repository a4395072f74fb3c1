#include "host-tests/campaign/proposal.hpp"

#include <array>
#include <utility>
#include <vector>

namespace probebox::campaign {
namespace {

using metrology::Estimate;

constexpr std::array kSubjects{"delay",   "delay", "screw-reference-x", "screw-reference-y", "screw-reference-z",
                               "rotary-c"};

metrology::Result delay(double at) {
  metrology::Result result;
  result.method = "delay-multi-speed";
  result.estimates = {Estimate::scalar("tau_s", 3.8e-3 + 1e-4 * at, 1e-4)};
  return result;
}

// As much as no rest would leave of it, so that a joint has to walk.
metrology::Result screwReference(double at) {
  metrology::Result result;
  result.method = "screw-reference";
  result.estimates = {Estimate::scalar("reference_um", 60 * at - 30, 10)};
  return result;
}

metrology::Result table(double at) {
  constexpr std::array kAngles_rad{0.0, 1.5, 3.0, 4.5};
  std::vector<double> errors;
  for (std::size_t k = 0; k < kAngles_rad.size(); ++k) {
    const double e_mm = 0.02 * at * static_cast<double>(k);
    errors.insert(errors.end(), {e_mm, -e_mm, 0.5 * e_mm, 0, 0, 1e-3 * e_mm});
  }
  const std::vector<double> sd(errors.size(), 1e-2);
  metrology::Result result;
  result.method = "rotary-axis-errors";
  result.estimates = {Estimate::matrix("six_errors", 6, errors, sd)};
  result.also = {Estimate::vector("axis_point_mm", {330, 200, -300}, {}),
                 Estimate::vector("axis_direction", {0, 0, 1}, {}),
                 Estimate::vector("angle_rad", {kAngles_rad.begin(), kAngles_rad.end()}, {})};
  return result;
}

}  // namespace

Proposal proposalOf(std::uint64_t number) {
  const std::string subject = kSubjects.at(number % kSubjects.size());
  const double at = static_cast<double>(number) / static_cast<double>(kProposals);
  auto result = subject == "delay" ? delay(at) : subject == "rotary-c" ? table(at) : screwReference(at);
  return {.subject = subject, .result = std::move(result)};
}

}  // namespace probebox::campaign
