#pragma once
#include <array>
#include <string>

#include "firmware/capture/recording.hpp"
#include "firmware/metrology/dataset/dataset.hpp"

namespace probebox::capture {

// What turns counts and stamps into millimetres and master time.
struct Scales {
  std::array<double, kLinearAxes> mm_per_count{};  // with the axis sense in its sign
  Nanoseconds nominal_period{};                    // of the master clock
};

// Seconds of the master clock in one nanosecond of the monotonic clock.
double masterSecondsPerNs(const TickMap& map, Nanoseconds nominal_period);

// The recorded touches as a case: positions of the tool in mm, deflection channels in mm at unit gain,
// times in seconds of the master clock counted from the first row of their touch. Nothing is resampled.
metrology::Dataset touchDataset(const Recording& recording, const Scales& scales, std::string method);

// The same of touches by edges: tables machine, touches, edges{touch,contact_s,release_s}.
metrology::Dataset edgeDataset(const Recording& recording, const Scales& scales, std::string method);

}  // namespace probebox::capture
