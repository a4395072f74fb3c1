#pragma once
#include <optional>
#include <string>

#include "firmware/procedure/plan/poses.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

// Steps at which a sensor head stands still over a ball.
namespace probebox::procedure {

std::optional<Error> whyNoHolds(const ProcedureOptions& options);
// options.head_tool: tool number of the head.
Step holdAt(const Pose& pose, Feature feature, const ProcedureOptions& options);
std::string holdPrompt(const Step& step);

}  // namespace probebox::procedure
