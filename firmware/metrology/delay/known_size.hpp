#pragma once
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/touch.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Size between surfaces that are touched from outside or from within, as the middle of the stylus ball sees it, mm: the
// certified one of key `size_key` with, or without, stylus_ball_diameter_mm, as the normals show. Refuses: missing-key;
// bad-config (also a ball that does not fit in).
Outcome<double, Refusal> effectiveSize(const Dataset& dataset, const std::vector<Touch>& touches,
                                       std::string_view size_key);

}  // namespace probebox::metrology
