#pragma once
#include <span>
#include <string>
#include <string_view>

namespace probebox {

// Returns the known word that was probably meant, by edit distance (a swap of neighbours is one edit), or an empty text
// when none is near enough.
std::string nearest(std::string_view word, std::span<const std::string> known);

// Returns "; did you mean delay-plates?", or an empty text.
std::string didYouMean(std::string_view word, std::span<const std::string> known);
std::string didYouMean(std::string_view word, std::span<const std::string_view> known);

}  // namespace probebox
