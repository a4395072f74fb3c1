#pragma once
#include <optional>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/touch.hpp"

namespace probebox::metrology {

// What the deflections of a touch tell of the time at which the stylus is free.
struct Parting {
  double at_s{};    // of the probe's stamps, at separation
  double fall_s{};  // from rest to separation
  double units_per_mm{};
};

// Refuses probe-not-at-zero: a channel of the free stylus, well after the separation or, where the record ends there,
// before the contact, reads more than 1 um and five sd of its mean. Ringing counts as correlated noise.
std::optional<Refusal> notAtZero(const Touch& touch, const Parting& parting);

}  // namespace probebox::metrology
