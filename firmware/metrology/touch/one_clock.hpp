#pragma once
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/touch/retract.hpp"
#include "firmware/metrology/touch/touch.hpp"

namespace probebox::metrology {

// Places of the machine where the deflection rises through a level and where it falls through it, the delay taken out:
// one place, whatever the gain is.
struct TwoPlaces {
  std::string touch;
  double speed_mm_s{};  // stated
  double apart_mm{};    // the place on the way in minus that on the way out
  double noise_mm{};    // its sd by the samples
  double overtravel_mm{};
  double mm_per_s{};  // by which a second of delay parts them
  double period_s{};  // of the machine's samples
};

// tau_s: the delay along the retract. Nothing where the approach is not in the record.
std::optional<TwoPlaces> twoPlaces(const Touch& touch, const Retract& retract, double tau_s);

// Refuses clocks-differ: the clock of one stream runs at another rate, or its stamps jump at rest.
std::optional<Refusal> clocksDiffer(const TwoPlaces& places, double sd_delay_s);

// Warns of two touches of one speed whose places are apart differently: what is common to all cancels, so that less
// shows than one touch could tell.
std::optional<std::string> ownDelays(const std::vector<TwoPlaces>& touches);

}  // namespace probebox::metrology
