#pragma once
#include <Eigen/Core>
#include <cstdint>

#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/live_method.hpp"
#include "tools/plan/set_up.hpp"

namespace probebox::plan {

// Returns the set-up with a touch-trigger probe if the method needs one.
SetUp withProbeFor(const procedure::LiveMethod& method, SetUp set_up);

// Describes the machine on which runs are simulated. tool: number of the tool that is measured.
procedure::Facts factsOf(const SetUp& set_up, std::uint32_t tool);

// Diameters of the datum sphere and the stylus ball together, at the temperature at which they are touched.
double touchedSphere_mm(const SetUp& set_up);

// Position of a ball of the part at C = 0: each is a third of a turn further and higher than the one before it.
Eigen::Vector3d ballAt(const SetUp& set_up, std::uint16_t number);

}  // namespace probebox::plan
