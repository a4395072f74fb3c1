#pragma once
#include <optional>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/stamp_jitter.hpp"
#include "firmware/metrology/touch/touch.hpp"

namespace probebox::metrology {

enum class ProbeZero { known, of_record };

// What is wrong with the record of one drive in and out as a whole: stamps-jump, and where the probe's zero is known
// probe-not-at-zero.
std::optional<Refusal> badDrive(const Touch& touch, const StampJitter& jitter, ProbeZero zero);

// Refuses speed-differs, from the nominal speed by more than 20 %: both streams by a clock of another rate show the
// same motion, and its speed alone tells.
std::optional<Refusal> speedOfDriveDiffers(const TouchPlan& plan, double speed_mm_s);

}  // namespace probebox::metrology
