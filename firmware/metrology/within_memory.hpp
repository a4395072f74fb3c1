#pragma once
#include <functional>

#include "firmware/metrology/dataset/result.hpp"

namespace probebox::metrology {

// What `work` answers; `too_much` where it asks for more memory than there is.
Solved withinMemory(const std::function<Solved()>& work, const Refusal& too_much);

}  // namespace probebox::metrology
