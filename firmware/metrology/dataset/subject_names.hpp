#pragma once
#include <string_view>

namespace probebox::metrology::subject {

// Prefixes of the subjects of results that keys "..._result" of a case name by number.
inline constexpr std::string_view kAssembly = "assembly-";
inline constexpr std::string_view kPreTravel = "pre-travel";

}  // namespace probebox::metrology::subject
