#pragma once
#include <cstdint>
#include <optional>

#include "firmware/procedure/plan/live_method.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::procedure {

// Names the first invalid option and its valid range; nullopt when the run can be planned. deflection_limit_mm: of the
// probe.
std::optional<Error> validate(const LiveMethod& method, const ProcedureOptions& options, double deflection_limit_mm);

// Names a value outside of its range, and the range; nullopt when it lies within.
std::optional<Error> outside(const char* what, double value, double from, double to, const char* unit);

// Fills in the steps of a run, for options that pass validate(). Does not allocate. Later loops append steps; without
// a state, those of the first loop.
void fill(Plan& plan, const LiveMethod& method, const ProcedureOptions& options, const LoopState& loops);
void fill(Plan& plan, const LiveMethod& method, const ProcedureOptions& options);

// How a probe reports a surface: by samples of its deflection, by a switch, or by samples of the distance.
enum class ProbeKind : std::uint8_t { scanning, trigger, distance };
ProbeKind probeKindOf(const Facts& facts);

// By which a drive towards a surface that is not touched goes on beyond its clearance, mm: it stays in the range.
inline constexpr double kDistanceRunOut_mm = 0.2;

// For a touch-trigger probe, converts the touches of a filled plan to touches by edges; those of the tool-setting
// device keep its edges. One that reads distances drives along its axis, Z. Does not allocate.
void takeReadings(Plan& plan, ProbeKind probe);

}  // namespace probebox::procedure
