#pragma once
#include <cstddef>
#include <string>

#include "firmware/procedure/plan/step.hpp"

namespace probebox::procedure {

// What a person or a controller is to do, in one sentence.
std::string promptFor(const Plan& plan, std::size_t step);

}  // namespace probebox::procedure
