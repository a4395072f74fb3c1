#pragma once
#include <string>
#include <vector>

#include "board/describe/parse.hpp"
#include "firmware/app/host/link_service.hpp"
#include "firmware/app/host/machine_description.hpp"
#include "firmware/app/host/sample_description.hpp"
#include "firmware/app/results/due_dates.hpp"
#include "firmware/app/results/results_in_force.hpp"
#include "firmware/box/box.hpp"
#include "firmware/procedure/plan/run_dataset.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/messages/handshake.hpp"

// Converts the descriptions to the configuration of the rooms.
namespace probebox::app {

box::BoxConfig boxConfig(const board::Descriptions& descriptions);
// The names that a host sees of machine and probe.
MachineNames namesOf(const board::Descriptions& descriptions);
ProbeOnMachine probeOnMachine(const board::Descriptions& descriptions);
// Without what is in force, which changes while the box runs.
messages::Descriptor wireDescriptor(const board::Descriptions& descriptions, const std::string& firmware_version);
// What the links say of this box, under a boot id that is drawn anew.
LinkService::Options linkOptions(const board::Descriptions& descriptions, const std::string& firmware_version);
// The digital inputs, with nothing counted yet.
std::vector<messages::LineStatus> wireLines(const board::Box& box);

// When what is to be measured again.
std::vector<results::Schedule> schedulesOf(const board::Machine& machine);
// Returns the probe, machine and mounting that results are bound to, and the travel that they must lie in.
Mounting mountingOf(const board::Descriptions& descriptions);

}  // namespace probebox::app
