#pragma once
#include <span>
#include <string>
#include <string_view>

namespace probebox {

// The known word that was probably meant, or an empty text when none is near enough (edits, with a swap of neighbours
// as one).
std::string nearest(std::string_view word, std::span<const std::string> known);

// "; did you mean delay-plates?", or an empty text.
std::string didYouMean(std::string_view word, std::span<const std::string> known);
std::string didYouMean(std::string_view word, std::span<const std::string_view> known);

}  // namespace probebox
