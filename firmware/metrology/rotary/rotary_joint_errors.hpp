#pragma once
#include <array>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Number of the mounting of the plate, where there are several.
inline constexpr MethodColumn kMount{"mount", ColumnRole::number, 0, MayBe::missing};

// Largest distance of a ball of `first` from its station, mm. Without effect if stations are not corrected.
inline constexpr const char* kStationRadiusKey = "station_radius_mm";
// Keys of sigmas beside sigma_mm, which they need.
inline constexpr std::array<const char*, 4> kOtherSigmas{"sigma_third_mm", "sigma_axial_mm", "sigma_angle_rad",
                                                         "sigma_offset_mm"};

// The six errors of a rotary axis from a ball plate in several mounts, from stations that see some of the balls only,
// or with errors of the linear axes removed (CN112247668, docs/metrology.md (E10)-(E12)). One least squares for all
// unknowns: the place of the plate in each mount, the six errors at each angle, with station_correction the error of
// the linear axes at each station, and with sigma_third_mm (of a certificate's coordinate) the certificate itself.
// Tables as rotary-axis-errors, first and second with `mount` before `ball`. Config also: station_correction: a reading
// belongs to the station of the ball of `second` that the nominal axis brings it next to; station_radius_mm (default
// 30). sigma_axial_mm: of coordinates along the axis (sigma_mm is then that of those across); sigma_angle_rad: of every
// stop of the axis, inseparable from the error about it; sigma_offset_mm: of a common offset of all readings (middle of
// the head), inseparable from the place of the axis. Gives the same keys. The row of angle zero is the error of the
// axis when first was read. Refuses: as rotary-axis-errors (bad-config also for sd_certificate_mm together with
// sigma_third_mm), and rank-too-small (the balls of an angle do not determine six errors), not-at-station.
Outcome<Result, Refusal> solveRotaryStack(const Dataset& dataset);

}  // namespace probebox::metrology
