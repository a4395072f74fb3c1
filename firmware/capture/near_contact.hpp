#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "firmware/capture/recording.hpp"

// A control marks a touch from beside the feature and back. Most of that is free way, and the solvers read little of
// it.
namespace probebox::capture {

// The probe is free for so long before and after what the solvers read: its noise is known from there. Also covers the
// delay between probe and machine data.
inline constexpr Nanoseconds kFree = std::chrono::milliseconds{100};
// And for at least so many rows of the probe, where it has been recorded with them.
inline constexpr std::ptrdiff_t kFreeRows = 5;

// Less deflection than this is no contact: noise of channels stays far below.
inline constexpr double kContact_mm = 0.005;
bool isInContact(const std::array<std::int32_t, 3>& channels_nm);

// Keeps of the newest touch, whose rows are complete, those from before the contact until the machine has retracted by
// all that the solvers read. Keeps everything where it is no touch, or no contact stands out from it.
void keepNearContact(Recording& recording, Touch& newest);

}  // namespace probebox::capture
