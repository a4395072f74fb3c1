#pragma once
#include <optional>
#include <vector>

#include "firmware/capture/recording.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/method.hpp"

namespace probebox::procedure {

// Adds to the touches of a run that reads balls: poses, centres corrected by the delay in force, and the tables and
// keys of the method. Refuses: no-delay, and what the computation of centres refuses.
std::optional<metrology::Refusal> addReadings(metrology::Dataset& dataset, Method method,
                                              const capture::Recording& recording, const Facts& facts);

// Tables first, second and third of rotary-axis-errors, and its keys: all balls at each station of C, the last one
// being the first again. Angles are relative to the first station.
void addPlate(metrology::Dataset& dataset, const std::vector<Reading>& readings, const BallPlate& plate,
              const Facts& facts);

}  // namespace probebox::procedure
