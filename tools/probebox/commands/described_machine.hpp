#pragma once
#include "board/describe/machine.hpp"
#include "board/describe/probe.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "protocol/messages/machine.hpp"
#include "tools/plan/set_up.hpp"
#include "tools/plan/wanted.hpp"

// Conversions between the descriptions of a machine: machine.toml, what a box says, and the set-up of a forecast.
namespace probebox::command {

// Replaces the machine that a box has named by that of a machine.toml, with the results in force about its parts. The
// certificate of the sphere stays where the file has that sphere, without one of its own.
void replaceMachine(messages::DescribeMachine::Answer& says, const board::Machine& machine);

// Replaces the probe by that of a probe.toml, at its nominal rate; what was calibrated with another one is gone.
void replaceProbe(messages::DescribeMachine::Answer& says, const board::Probe& probe);

// Takes the probe that is described, its rate and that of the positions into a set-up; the rest stays as it is.
void takeProbe(plan::SetUp& set_up, const messages::DescribeMachine::Answer& says);
// Takes what is described into a set-up; the rest stays as it is. wanted: for the screw that it is about.
void takeMachine(plan::SetUp& set_up, const messages::DescribeMachine::Answer& says, const plan::Wanted& wanted);

// The facts of a set-up without those of parts that are not described; where a box was asked, also without results that
// are not in force.
procedure::Facts describedFacts(const plan::SetUp& set_up, const messages::DescribeMachine::Answer& says,
                                const plan::Wanted& wanted, bool of_box);

}  // namespace probebox::command
