#pragma once
#include <functional>

#include "firmware/metrology/dataset/result.hpp"

namespace probebox::casefolder {

// What `solve` answers. Refuses too-much-memory where it asks for more memory than there is.
metrology::Solved withinMemory(const std::function<metrology::Solved()>& solve);

}  // namespace probebox::casefolder
