#pragma once

namespace probebox::metrology {

// sd of the mean of rounded readings: noise below the resolution does not average its steps out. sd_reading: scatter of
// the readings; step: their resolution, in the same unit.
double roundingSd(double sd_reading, double step);

}  // namespace probebox::metrology
