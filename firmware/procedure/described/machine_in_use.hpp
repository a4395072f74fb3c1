#pragma once
#include "firmware/procedure/facts/facts.hpp"
#include "protocol/messages/machine.hpp"

namespace probebox::procedure {

// Describes the parts of the machine to a host: neither names nor probe, rates and delay, which no machine.toml has.
messages::DescribeMachine::Answer machineInUse(const Facts& facts);

}  // namespace probebox::procedure
