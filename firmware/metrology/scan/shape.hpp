#pragma once
#include <string>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Config key `shape`: sphere, cylinder, plane-pair, box or plane. Refuses: missing-key, bad-config.
Outcome<std::string, Refusal> requiredShape(const Dataset& dataset);

}  // namespace probebox::metrology
