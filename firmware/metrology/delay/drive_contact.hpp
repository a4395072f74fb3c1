#pragma once
#include <optional>
#include <string>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/scan/quantised_legs.hpp"
#include "firmware/metrology/scan/waveform_match.hpp"
#include "firmware/metrology/touch/touch.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// The contact of one drive, and both streams along it: they fall into the surface and come back.
struct DriveContact {
  std::string name;
  Signal machine;  // mm, along the retract
  Signal probe;    // raw, against the deflection, so that both have their lowest point at the apex
  double from{};   // stamps of the first and last deflected sample, probe time, s
  double until{};
  double machine_apex_s{};
  double probe_apex_s{};
  std::optional<RoundedMotion> rounded{};
  double kink_s{};  // on either side of the apex, that lines between samples cannot follow
  double speed_mm_s{};
};

// Refuses: no-contact, truncated, gap, flat-apex, clipped, too-few-samples.
Outcome<DriveContact, Refusal> contactOf(const Touch& touch);

}  // namespace probebox::metrology
