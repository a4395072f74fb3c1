#pragma once
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/facts/facts.hpp"

namespace probebox::procedure {

// Adds tables and keys of rotary-axis-errors from readings of a ball plate by probe or head: first coordinates at the
// angles of C or B, second ones with the axis at zero, third ones from the certificate.
void addPlate(metrology::Dataset& dataset, const std::vector<Reading>& readings, const BallPlate& plate,
              const Facts& facts);

}  // namespace probebox::procedure
