#pragma once
#include <string_view>

namespace probebox::metrology::subject {

// What the subjects of results begin with that cases name in keys "..._result".
inline constexpr std::string_view kAssembly = "assembly-";
inline constexpr std::string_view kPreTravel = "pre-travel";

}  // namespace probebox::metrology::subject
