#pragma once
#include <Eigen/Core>
#include <cstdint>

#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/live_method.hpp"
#include "tools/plan/set_up.hpp"

namespace probebox::plan {

// The descriptions of the machine on which runs are simulated. tool: the one that is measured.
// The set-up with a touch-trigger probe where the method needs one.
SetUp withProbeFor(const procedure::LiveMethod& method, SetUp set_up);

procedure::Facts factsOf(const SetUp& set_up, std::uint32_t tool);

// Where a ball of the part stands at C = 0: a third of a turn further and higher than the one before it.
Eigen::Vector3d ballAt(const SetUp& set_up, std::uint16_t number);

}  // namespace probebox::plan
