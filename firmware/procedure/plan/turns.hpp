#pragma once
#include <string>

#include "firmware/procedure/plan/step.hpp"
#include "protocol/events/event.hpp"

// Steps in which C turns until the ball on the rim touches the stylus, which stands still beside the nominal line.
namespace probebox::procedure {

// Speed of the ball along its circle: slow enough to stop within a part of the overtravel.
inline constexpr double kTurn_mm_s = 2;

// side: 1 or -1, where the stylus stands along X from the nominal line. The ball comes from the other side.
Step turnBeside(double side, const ProcedureOptions& options);
std::string turnPrompt(const Step& step);

}  // namespace probebox::procedure
