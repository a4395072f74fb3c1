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

// What the options of `gcode` say of machine and control, and whether they fit the run.
namespace probebox::command {

// Axis about which B turns right-handed.
Eigen::Vector3d bAxisOf(const Gcode& options);
// Trouble: two axes with one word, or a word that the dialect does not have.
Outcome<gcode::Setting, Trouble> settingOf(const Gcode& options);
// What a run depends on that only machine.toml has, and that was not given.
std::optional<Trouble> whyNotGiven(const Gcode& options, const procedure::Plan& plan, const gcode::Dialect& dialect);
// More than a run has room for.
std::optional<Trouble> whyTooMany(const Gcode& options);
// An option that this run does not use: whoever gives it means another run.
std::optional<Trouble> whyNotUsed(const Gcode& options, const procedure::Plan& plan);
std::optional<Trouble> whyWordNotUsed(const Gcode& options, const gcode::Blocks& blocks);

}  // namespace probebox::command
