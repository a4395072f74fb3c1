#pragma once
#include <cstddef>
#include <string>

#include "firmware/procedure/plan/step.hpp"

namespace probebox::procedure {

// Describes a step to the operator or controller in one sentence.
std::string promptFor(const Plan& plan, std::size_t step);

// "A at 180, B at 0 and C at 0 deg", without B where the prompt says what B moves.
std::string anglesOf(const Step& step);

// "+X side of the sphere".
std::string surfaceOf(const Step& step);

}  // namespace probebox::procedure
