#pragma once
#include <optional>
#include <vector>

#include "firmware/capture/recording.hpp"
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/facts/facts.hpp"

namespace probebox::procedure {

// Refuses mounts-differ: at a stop that the axis has turned to in several mounts, the angles from where each mount
// began differ by more than kPoseTolerance_rad.
std::optional<metrology::Refusal> whyMountsDiffer(const capture::Recording& recording);

// Adds tables and keys of rotary-axis-errors from readings of a ball plate by probe or head: first coordinates at the
// angles of C or B, second ones with the axis at zero, third ones from the certificate. A stop has one angle, the mean
// of what its mounts report; their balls are turned to it about the nominal axis.
void addPlate(metrology::Dataset& dataset, const std::vector<Reading>& readings, const BallPlate& plate,
              const Facts& facts);

}  // namespace probebox::procedure
