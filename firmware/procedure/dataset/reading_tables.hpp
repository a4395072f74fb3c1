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

// Adds to the touches of a run that reads balls: the poses, the centres with the delay in force taken out, and the
// tables and keys of the method. Refusal: the centres could not be computed; no-delay.
std::optional<metrology::Refusal> addReadings(metrology::Dataset& dataset, Method method,
                                              const capture::Recording& recording, const Facts& facts);

// Tables first, second and third of rotary-axis-errors, and its keys: all balls at each stop of C, and at the last one
// where C began. Angles count from there.
void addPlate(metrology::Dataset& dataset, const std::vector<Reading>& readings, const BallPlate& plate,
              const Facts& facts);

}  // namespace probebox::procedure
