#include "protocol/units/wording.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

namespace probebox {
namespace {

struct Character {
  char32_t code{};
  std::size_t bytes{1};
  bool good{};  // UTF-8
};

// Unicode 15, table 3-7: no overlong form, no surrogate, nothing beyond U+10FFFF.
Character firstOf(std::string_view text) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const unsigned lead = byte(0);
  if (lead < 0x80) return {.code = lead, .bytes = 1, .good = true};
  const std::size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < bytes) return {};
  char32_t code = lead & (0xFFU >> (bytes + 1));
  for (std::size_t k = 1; k < bytes; ++k) {
    if ((byte(k) & 0xC0U) != 0x80) return {};
    code = code << 6U | (byte(k) & 0x3FU);
  }
  constexpr std::array<char32_t, 5> kLeast{0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xD800 && code <= 0xDFFF;
  if (code < kLeast[bytes] || code > 0x10FFFF || surrogate) return {};
  return {.code = code, .bytes = bytes, .good = true};
}

struct Span {
  char32_t from, to;
  const char* what;
};
constexpr const char* kBreak = "a line break";
constexpr const char* kControl = "a control character";
constexpr const char* kDirection = "a character that turns the direction of writing";
constexpr const char* kInvisible = "an invisible character";
// Looked through from the top; categories Cc, Cf, Zl and Zp of Unicode, variation selectors and tags.
constexpr std::array kNotShown{
    Span{U'\n', U'\n', kBreak},        Span{U'\r', U'\r', kBreak},       Span{U'\t', U'\t', "a tabulator"},
    Span{0x00, 0x1F, kControl},        Span{0x7F, 0x9F, kControl},       Span{0xAD, 0xAD, kInvisible},
    Span{0x61C, 0x61C, kDirection},    Span{0x180E, 0x180E, kInvisible}, Span{0x200B, 0x200D, kInvisible},
    Span{0x200E, 0x200F, kDirection},  Span{0x2028, 0x2029, kBreak},     Span{0x202A, 0x202E, kDirection},
    Span{0x2060, 0x2064, kInvisible},  Span{0x2066, 0x2069, kDirection}, Span{0x206A, 0x206F, kControl},
    Span{0xFE00, 0xFE0F, kInvisible},  Span{0xFEFF, 0xFEFF, kInvisible}, Span{0xFFF9, 0xFFFB, kControl},
    Span{0xE0000, 0xE0FFF, kInvisible}};
constexpr std::array kBlank{Span{U' ', U' ', ""},     Span{0xA0, 0xA0, ""},     Span{0x1680, 0x1680, ""},
                            Span{0x2000, 0x200A, ""}, Span{0x202F, 0x202F, ""}, Span{0x205F, 0x205F, ""},
                            Span{0x3000, 0x3000, ""}, Span{0x2800, 0x2800, ""}, Span{0x3164, 0x3164, ""}};

const Span* spanOf(std::span<const Span> spans, char32_t code) {
  const auto found = std::ranges::find_if(spans, [&](const Span& s) { return code >= s.from && code <= s.to; });
  return found == spans.end() ? nullptr : &*found;
}

std::string shown(std::string_view text, std::size_t most_characters, std::string_view kept) {
  std::string all;
  for (std::size_t length = 0; !text.empty(); ++length) {
    if (length == most_characters) return all + "...";
    const auto character = firstOf(text);
    const bool prints = character.good && spanOf(kNotShown, character.code) == nullptr;
    if (prints || kept.find(text.front()) != std::string_view::npos) {
      all += text.substr(0, character.bytes);
    } else {
      all += '?';
    }
    text.remove_prefix(character.bytes);
  }
  return all;
}

bool isBlank(std::string_view text) {
  for (; !text.empty(); text.remove_prefix(firstOf(text).bytes)) {
    if (spanOf(kBlank, firstOf(text).code) == nullptr) return false;
  }
  return true;
}

}  // namespace

std::optional<std::string> whyUnprintable(std::string_view text) {
  while (!text.empty()) {
    const auto character = firstOf(text);
    if (!character.good) return "a byte that is no UTF-8";
    if (const auto* span = spanOf(kNotShown, character.code)) {
      std::array<char, 16> code{};
      std::snprintf(code.data(), code.size(), " (U+%04X)", static_cast<unsigned>(character.code));
      return std::string{span->what} + code.data();
    }
    text.remove_prefix(character.bytes);
  }
  return std::nullopt;
}

std::size_t lengthOf(std::string_view text) {
  std::size_t length = 0;
  for (; !text.empty(); ++length) text.remove_prefix(firstOf(text).bytes);
  return length;
}

std::string shown(std::string_view text, std::size_t most_characters) {
  return shown(text, most_characters, {});
}

std::string shownLines(std::string_view text) {
  return shown(text, std::string_view::npos, "\n\t");
}

std::string hexadecimal(std::span<const std::byte> bytes) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string all;
  for (const auto byte : bytes) {
    all += kDigits[std::to_integer<unsigned>(byte) >> 4U];
    all += kDigits[std::to_integer<unsigned>(byte) & 15U];
  }
  return all;
}

std::optional<Error> whyNoName(std::string_view name) {
  if (isBlank(name)) return Error{"The name of the person is blank: say who does it, such as --by Ada."};
  if (const auto why = whyUnprintable(name)) {
    return Error{"The name of the person, \"" + shown(name, 60) + "\", has " + *why +
                 ": write it in letters that print."};
  }
  if (lengthOf(name) > kLongestName) {
    return Error{"The name of the person has " + std::to_string(lengthOf(name)) +
                 " characters: " + std::to_string(kLongestName) + " are the most."};
  }
  return std::nullopt;
}

}  // namespace probebox
