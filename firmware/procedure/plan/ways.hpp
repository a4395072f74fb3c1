#pragma once
#include <optional>

#include "firmware/procedure/facts/facts.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::procedure {

// Refuses a run in which the stylus would come to another ball of [ball_plate] on its way to a touch or off it:
// straight down from above its ball, round that at kAround_mm from its surface, and straight up from the last touch.
// Balls of a tilted table stand one above the other. The stylus is taken to be as thick as its ball, and to hang from
// above. A further mount turns the plate about C as described; where that is not known, the way has to be free however
// it is turned. Nothing where the size of the balls or the tilt axis is not described.
std::optional<Error> whyThroughBall(const Plan& plan, const Facts& facts);

}  // namespace probebox::procedure
