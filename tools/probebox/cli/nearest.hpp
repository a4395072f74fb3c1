#pragma once
#include <span>
#include <string>
#include <string_view>

namespace probebox::command {

// The known word that was probably meant, or an empty text when none is near enough (edits, with a swap of neighbours
// as one).
std::string nearest(std::string_view word, std::span<const std::string> known);

}  // namespace probebox::command
