#pragma once
#include <string>
#include <vector>

#include "firmware/metrology/checks.hpp"
#include "firmware/metrology/dataset.hpp"
#include "firmware/metrology/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// How much less certain one touch with a shank is than one coordinate of a ball that was read with a tip: config
// sigma_shank_mm over sigma_mm; 1 where either is not stated. Refuses: bad-config.
struct ShankSigma {
  double ratio{1.0};
  std::vector<std::string> warnings;
};
Outcome<ShankSigma, Refusal> shankSigma(const Dataset& dataset, const Sigma& of_tip);

}  // namespace probebox::metrology
