#pragma once
#include <string>
#include <string_view>

namespace probebox::casefolder {

// What a line of an uncertainty budget is about: "certificate of the sphere (sd_effective_diameter_mm)", with the key
// of the case that states it; "stop of the tilting table"; the name itself where no other is known.
std::string budgetName(std::string_view name);

// A key as words: "Z offset error" for z_offset_error. Letters of axes alone are capitals, as in ISO 841.
std::string keyInWords(std::string key);

}  // namespace probebox::casefolder
