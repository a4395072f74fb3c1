#pragma once
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// Tests for the keys that every method accepts for the record: probe, probe_tool (number of the tool that carries it),
// machine, mounting, measured_utc, measured_by, temperature_c, note, sphere_certificate, sphere_next_due.
bool isCondition(std::string_view key);

// Those keys that the case states, in this order.
std::vector<Condition> conditionsOf(const Dataset& dataset);

}  // namespace probebox::metrology
