#pragma once
#include <optional>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/touch.hpp"

namespace probebox::metrology {

// Refuses stamps-jump: the machine moves evenly on both sides of an interval of unusual length and has not moved as far
// as its speed takes it in that interval, anywhere in the record. Lost samples are no jump. jitter_s: of the machine's
// stamps.
std::optional<Refusal> stampsJump(const Touch& touch, double jitter_s);

}  // namespace probebox::metrology
