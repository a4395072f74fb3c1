#pragma once
#include <span>
#include <vector>

#include "firmware/metrology/selftest/selftest.hpp"
#include "protocol/messages/corrections.hpp"
#include "protocol/messages/status.hpp"

// Finds index inputs that have given no pulse.
namespace probebox::command {

// Returns one finding for each index input without a pulse whose axis is not referenced: the axis has not passed the
// mark, or it is not wired. A silent mark of an axis that is referenced otherwise is no fault.
std::vector<metrology::Finding> silentIndexes(const std::vector<messages::LineStatus>& lines,
                                              std::span<const published::AxisState> axes);

}  // namespace probebox::command
