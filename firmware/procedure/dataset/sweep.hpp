#pragma once
#include "firmware/capture/recording.hpp"
#include "firmware/capture/touch_dataset.hpp"
#include "firmware/procedure/dataset/measured_case.hpp"
#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/method.hpp"

// A sweep turns the ball screw of one axis slowly, through whole turns, while the sensor at its end is read: the live
// half of screw-calibration (docs/metrology.md D4).
namespace probebox::procedure {

// The options of a sweep with the travel and the speed that machine.toml's screw asks for. `turns`: whole ones, 0 for
// four. An error names what cannot be: no axis, an axis whose screw is not described, too few turns, a screw that would
// turn faster than its sensor can follow, or so slowly that a recording cannot hold it.
Outcome<ProcedureOptions> sweepOptions(ProcedureOptions options, unsigned turns, const Facts& facts);

// Why a sweep cannot begin at this machine position: its way would end beyond the axis. Says where it can begin.
// `sweep`: of sweepOptions().
std::optional<Error> whyNoRoom(const ProcedureOptions& sweep, double position_mm, const Facts& facts);

// What a sweep measured, as a case of screw-calibration: readings of the sensor against the angle of the screw, which
// is the position of the motor between its neighbours in time, and 0 where machine.toml says that sector 0 begins. The
// gain is not measured, so the case states the one that stays. A reading without a position on either side has no
// angle: it is left out, with a warning.
RunDataset sweepDataset(const capture::Recording& recording, const capture::Scales& scales, const Facts& facts);

}  // namespace probebox::procedure
