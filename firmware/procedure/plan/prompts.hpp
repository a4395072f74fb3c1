#pragma once
#include <cstddef>
#include <string>

#include "firmware/procedure/plan/step.hpp"

namespace probebox::procedure {

// Describes a step to the operator or controller in one sentence.
std::string promptFor(const Plan& plan, std::size_t step);

// "+X side of the sphere".
std::string surfaceOf(const Step& step);

}  // namespace probebox::procedure
