#pragma once
#include <array>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"

// What an error of a tool's length does to the readings of a swivelling head (B20b).
namespace probebox::metrology {

// Tools are numbered in the order in which their lengths L_mm come in table readings; a shank is one of the first.
inline constexpr std::array<KnownQuantity, 4> kLengthsOfSwivel{
    {{"sd_length_1_mm", column::kToolLength.name, KnownKind::moves, false, "length of the first tool"},
     {"sd_length_2_mm", column::kToolLength.name, KnownKind::moves, false, "length of the second tool"},
     {"sd_length_3_mm", column::kToolLength.name, KnownKind::moves, false, "length of the third tool"},
     {"sd_length_4_mm", column::kToolLength.name, KnownKind::moves, false, "length of the fourth tool"}}};

// Changes of the reported ball by one mm of the length of the tool that the key names: -(R(B) - I) w, w the direction
// of the tool with the head level. Empty where the readings have no such tool.
std::vector<Table> movedByLength(const Dataset& dataset, std::string_view sd_key);

}  // namespace probebox::metrology
