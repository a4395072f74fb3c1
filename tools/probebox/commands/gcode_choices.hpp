#pragma once
#include <Eigen/Core>
#include <optional>

#include "firmware/procedure/plan/step.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/gcode/block.hpp"
#include "tools/gcode/dialect.hpp"
#include "tools/gcode/setting.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/cli/request.hpp"

// Reads the options of `gcode` about machine and control, and checks them against the run.
namespace probebox::command {

// Axis about which B turns right-handed.
Eigen::Vector3d bAxisOf(const Gcode& options);
// Trouble: two axes with one word, or a word that the dialect does not have.
Outcome<gcode::Setting, Trouble> settingOf(const Gcode& options);
// Explains which fact the run needs from machine.toml, where none was given.
std::optional<Trouble> whyNotGiven(const Gcode& options, const procedure::Plan& plan, const gcode::Dialect& dialect);
// Explains which option exceeds the limits of a run.
std::optional<Trouble> whyTooMany(const Gcode& options);
// Explains which given option this run does not use: it is probably meant for another run.
std::optional<Trouble> whyNotUsed(const Gcode& options, const procedure::Plan& plan);
std::optional<Trouble> whyWordNotUsed(const Gcode& options, const gcode::Blocks& blocks);

}  // namespace probebox::command
