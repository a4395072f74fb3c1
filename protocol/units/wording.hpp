#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

#include "protocol/units/outcome.hpp"

// Text that comes from outside: from a file, a host, a box. A terminal obeys control characters, and a reader is misled
// by invisible ones and by those that turn the direction of writing.
namespace probebox {

inline constexpr std::size_t kLongestName = 100;  // characters

// Why a text cannot be shown to a person as it is: a line break, another control character (C0, C1), one that turns the
// direction of writing, one that is invisible, or bytes that are no UTF-8. Nothing when all of it prints.
std::optional<std::string> whyUnprintable(std::string_view text);

// The number of characters of a UTF-8 text.
std::size_t lengthOf(std::string_view text);

// One line for a terminal and a log: what does not print becomes '?', and of a long text the beginning is left.
std::string shown(std::string_view text, std::size_t most_characters = std::string_view::npos);

// The same for text of several lines: line breaks and tabulators stay.
std::string shownLines(std::string_view text);

// Why this is not the name of a person, for a history that others read: it is blank, too long or does not print.
std::optional<Error> whyNoName(std::string_view name);

}  // namespace probebox
