#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Ratio of the sd of some coordinates to that of the others: config `key` / sigma_mm; 1 when either is not stated.
// Refuses: bad-config.
struct RelativeSigma {
  double ratio{1.0};
  std::vector<std::string> warnings;
};
Outcome<RelativeSigma, Refusal> relativeSigma(const Dataset& dataset, std::string_view key, const Sigma& usual);

}  // namespace probebox::metrology
