#pragma once
#include <span>
#include <vector>

#include "firmware/app/results/results_in_force.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/store/record.hpp"
#include "protocol/messages/corrections.hpp"

// The newest result in force replaces what machine.toml states.
namespace probebox::app {

// Adds what a result in force says about the checked ball or the setting device.
void addFacts(const store::Record& record, MeasuredFacts& facts);

// Every value that the descriptions or results give, by the name of its subject, with its source.
std::vector<messages::ValueInUse> valuesInUse(const procedure::Facts& described,
                                              std::span<const InForceAbout> in_force);

}  // namespace probebox::app
