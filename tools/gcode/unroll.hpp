#pragma once
#include "firmware/procedure/plan/step.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/gcode/block.hpp"
#include "tools/gcode/setting.hpp"

namespace probebox::gcode {

// Turns the plan of a run into moves, marks and stops. Error, with the remedy: the setting lacks something, or later
// steps depend on measured values, so that no fixed program can do the run.
Outcome<Blocks> unroll(const procedure::Plan& plan, const Setting& setting);

// Returns how far beyond the place of a surface the probe seeks it, mm.
double seekOf(const Setting& setting);
// Returns the height by which the whole path has to be lifted to stay at or above the safe height, mm.
double liftOfDryRun(const Blocks& blocks, double safe_z_mm);
// Returns the path lifted by lift_mm, without marks and stops.
Blocks dryRun(const Blocks& blocks, double lift_mm);

}  // namespace probebox::gcode
