#pragma once
#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "protocol/units/outcome.hpp"

// Makes text from outside (a file, a host, a box) safe to show. A terminal obeys control characters, and invisible ones
// and those that turn the direction of writing mislead a reader.
namespace probebox {

inline constexpr std::size_t kLongestName = 100;  // characters

// Explains why a text cannot be shown unchanged: a line break, another control character (C0, C1), one that turns the
// direction of writing, an invisible one, or bytes that are not UTF-8. Nothing when all of it prints.
std::optional<std::string> whyUnprintable(std::string_view text);

// The number of characters of a UTF-8 text.
std::size_t lengthOf(std::string_view text);

// Makes one line for a terminal or a log: unprintable characters become '?', and a long text is cut at its end.
std::string shown(std::string_view text, std::size_t most_characters = std::string_view::npos);

// The same for text of several lines: line breaks and tabs stay.
std::string shownLines(std::string_view text);

// Bytes as lower-case digits, two a byte.
std::string hexadecimal(std::span<const std::byte> bytes);

// Explains why a text is not usable as the name of a person in a history: it is blank, too long or does not print.
std::optional<Error> whyNoName(std::string_view name);

}  // namespace probebox
