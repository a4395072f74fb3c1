#pragma once
#include "protocol/units/outcome.hpp"
#include "tools/fleet/metrics/box_metrics.hpp"
#include "tools/probebox/link/box.hpp"

namespace probebox::command {

// Asks a box for all that its metrics show: of a result in force the values that a next one of its subject is compared
// by, so that who follows them sees no place where a sphere happened to stand. before: an earlier answer of the same box, of which results that are still
// in force need not be fetched again; may be null.
Outcome<fleet::Observed, Trouble> observedBox(link::Client& box, Console& console,
                                              const fleet::Observed* before = nullptr);

}  // namespace probebox::command
