#pragma once
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// A non-contact probe measures the distance from the surface, mm, along its axis. The decrease of the distance replaces
// the deflection, with gain 1 (CN101622513, docs/metrology.md A.10).

// Reads probe_kind: deflection (default) or distance. Refuses: bad-config.
Outcome<bool, Refusal> readsDistances(const Dataset& dataset);

// The distance that counts as zero deflection.
enum class Undeflected {
  ends,      // the smaller of the first and last distance: a drive begins and ends clear of the surface
  farthest,  // a millimetre more than the largest distance: a scan is never clear of it
};

// Replaces a table probe of distances by one of deflections a, b, c, by touch or scan as in column `group`: a is the
// decrease of the distance. Refuses what checkedTable refuses.
Outcome<Dataset, Refusal> withDeflections(const Dataset& dataset, std::string_view group, Undeflected undeflected);

}  // namespace probebox::metrology
