#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// Refuses frozen-channel: a measured column of the readings whose values are equal in every digit, where the stated
// sigma, or 0.1 um without one, would have changed the digits. A column of zeros has the digits of the others, and is
// allowed where no promised value depends on it. The sd of such readings is not to be believed.
std::optional<Refusal> frozenChannel(const Dataset& dataset, const Method& method);

// One sentence for everything in the readings of a case that looks like a slip of a person and that no fit can show:
// rows that are copies, which make every standard deviation too small, digits coarser than the stated sigma, and
// columns that look as if they had another unit than their name says: degrees for radians, millimetres for micrometres,
// milliseconds for seconds.
std::vector<std::string> slipsIn(const Dataset& dataset, const Method& method);

}  // namespace probebox::metrology
