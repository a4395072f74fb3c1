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

// How a probe reports a contact: by samples of its deflection, or by a switch.
enum class ProbeKind : std::uint8_t { scanning, trigger };

// For a touch-trigger probe, converts the touches of a filled plan to touches by edges. Those of the tool-setting
// device keep its edges. Does not allocate.
void takeReadings(Plan& plan, ProbeKind probe);

}  // namespace probebox::procedure
