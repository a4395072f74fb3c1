#pragma once
#include <cstddef>
#include <optional>
#include <string>

#include "firmware/procedure/plan/method_table.hpp"
#include "firmware/procedure/plan/poses.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

// Steps at which a sensor head stands still over a ball: small moves around one ball, or one position per ball and
// pose.
namespace probebox::procedure {

std::optional<Error> whyNoHolds(const ProcedureOptions& options);
std::size_t holdCount(const MethodRow& row, const Chosen& with);
// options.head_tool is the head. Calibration moves are at most two fifths of its range.
void addHolds(Plan& plan, const MethodRow& row, const Chosen& with, const ProcedureOptions& options);
std::string holdPrompt(const Step& step);

}  // namespace probebox::procedure
