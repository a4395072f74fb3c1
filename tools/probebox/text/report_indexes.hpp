#pragma once
#include <vector>

#include "firmware/metrology/selftest/selftest.hpp"
#include "protocol/messages/corrections.hpp"
#include "protocol/messages/status.hpp"

// Index marks that the box has not heard of.
namespace probebox::command {

// One finding for each index input without a pulse whose axis is not referenced: the mark was not passed, or it is not
// wired. Where the axis has its reference otherwise, a silent mark is no fault.
std::vector<metrology::Finding> silentIndexes(const std::vector<messages::LineStatus>& lines,
                                              const std::vector<messages::AxisStatus>& axes);

}  // namespace probebox::command
