#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/live/screw_model.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Reads length, offset and sense of a screw: config screw_length_mm, orgoff_mm, axis_reversed. Refuses: missing-key,
// bad-config.
Outcome<ScrewModel, Refusal> screwOf(const Dataset& dataset);

}  // namespace probebox::metrology
