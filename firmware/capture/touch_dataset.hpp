#pragma once
#include <array>
#include <string>

#include "firmware/capture/recording.hpp"
#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::capture {

// Factors from counts and stamps to millimetres and master time.
struct Scales {
  std::array<double, kLinearAxes> mm_per_count{};  // signed by the sense of the axis
  Nanoseconds nominal_period{};                    // of the master clock
};

// Position of the tool, mm: that of the encoders less the extension of the screws. offset_mm: of the recording.
std::array<double, kLinearAxes> position_mm(const MachineRow& row, const Scales& scales,
                                            const std::array<double, kLinearAxes>& offset_mm);

// Returns the seconds of the master clock in one nanosecond of CLOCK_MONOTONIC.
double masterSecondsPerNs(const TickMap& map, Nanoseconds nominal_period);

// Converts the recorded touches to a case: tool positions in mm, deflection channels in mm at unit gain, times in s of
// the master clock from the first row of each touch. Nothing is resampled.
metrology::Dataset touchDataset(const Recording& recording, const Scales& scales, std::string method);

// Converts touches by edges in the same way: tables machine, touches, edges{touch,contact_s,release_s}.
metrology::Dataset edgeDataset(const Recording& recording, const Scales& scales, std::string method);

}  // namespace probebox::capture
