#pragma once
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// A probe that does not touch reads its distance from the surface, mm, on one channel along its axis; it takes the
// place of the deflection with the gain 1: what the distance falls by (CN101622513, docs/metrology.md A.10).

// Config key probe_kind: deflection (without the key too) or distance. Refuses: bad-config.
Outcome<bool, Refusal> readsDistances(const Dataset& dataset);

// What counts as no deflection.
enum class Undeflected {
  ends,      // the smaller of the first and last distance: a drive begins and ends clear of the surface
  farthest,  // a millimetre more than the largest distance: a scan is never clear of it
};

// The dataset with a table probe of deflections a, b, c from one of distances, by touch or scan as the column `group`
// tells: a is what the distance has fallen by. Refuses what checkedTable refuses.
Outcome<Dataset, Refusal> withDeflections(const Dataset& dataset, std::string_view group, Undeflected undeflected);

}  // namespace probebox::metrology
