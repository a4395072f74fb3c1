#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "firmware/procedure/plan/live_method.hpp"

// A sweep turns the ball screw of one axis slowly through whole turns while the sensor at its end is read: the live
// part of screw-calibration (docs/metrology.md D4).
namespace probebox::procedure {

// Appends the readings of one step that have positions before and after them, over time and angle, where angle 0 is the
// begin of sector 0; returns the number of the others.
std::size_t appendScrewReadings(const FinishedRun& run, const capture::Touch& step, metrology::Table& table);
// The warning about them; nothing for 0.
std::optional<std::string> unplacedReadings(std::size_t unplaced, std::size_t readings);

// Explains why the sensor of this axis' screw cannot be read now, or its angle is unknown.
std::optional<Error> whyScrewUnread(std::uint8_t axis, const MachineNow& now);

// Computes travel and speed of a sweep from the screw in machine.toml and options.turns: whole turns, 0 for four.
// Errors: no axis, a screw that is not described, too few turns, a speed that its sensor cannot follow, or one too slow
// for the recording.
Outcome<ProcedureOptions> sweepOptions(ProcedureOptions options, const Facts& facts);

// Explains why a sweep cannot begin at this machine position: it would end beyond the axis. Names the possible range.
// `sweep`: from sweepOptions().
std::optional<Error> whyNoRoom(const ProcedureOptions& sweep, double position_mm, const Facts& facts);

// Builds a case of screw-calibration: sensor readings over the angle of the screw, which follows from motor positions
// interpolated in time; angle 0 is the begin of sector 0. The gain is not measured, so the case states the present one.
// Readings without positions on both sides are omitted with a warning.
RunDataset sweepDataset(const FinishedRun& run);

}  // namespace probebox::procedure
