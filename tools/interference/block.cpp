#include "tools/interference/block.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>

namespace probebox::interference {
namespace {

constexpr double kFurthest = 1e5;  // of a word that is a place, mm or inch

bool isPlace(char letter) {
  return std::string_view{"GTXYZABCIJKR"}.find(letter) != std::string_view::npos;
}

std::optional<Refusal> comment(char c, bool inside, std::size_t line) {
  // Where a comment within another ends, controls do not agree.
  if (c == '(' && inside)
    return Refusal{"bad-comment", line, "a comment within a comment: close the first one before it"};
  if (c == ')' && !inside) return Refusal{"bad-comment", line, "a ) that ends no comment: remove it"};
  return std::nullopt;
}

}  // namespace

Outcome<std::string, Refusal> bare(std::string_view text, bool siemens, std::size_t line) {
  std::string all;
  bool inside = false;  // a comment; for Siemens a text in quotes
  for (const char c : text) {
    if (c == ';' && !inside) break;
    if (siemens && c == '"') inside = !inside;
    const bool bracket = !siemens && (c == '(' || c == ')');
    if (bracket) {
      if (const auto wrong = comment(c, inside, line)) return *wrong;
      inside = c == '(';
    } else if ((siemens || !inside) && std::isspace(static_cast<unsigned char>(c)) == 0) {
      all += static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
    }
  }
  if (inside && !siemens) return Refusal{"bad-comment", line, "a comment without end: close it"};
  return all;
}

bool beginsWith(std::string_view text, std::initializer_list<std::string_view> words) {
  return std::ranges::any_of(words, [&](std::string_view word) { return text.starts_with(word); });
}

Outcome<Block, Refusal> Block::of(const std::string& text, std::size_t line) {
  Block block;
  block.line_ = line;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t begin = at;
    const char letter = text[at++];
    if (at < text.size() && text[at] == '+') ++at;
    double value = 0;
    const auto [end, fault] =
        std::from_chars(text.data() + at, text.data() + text.size(), value, std::chars_format::fixed);
    // from_chars takes INF and NAN for numbers.
    const bool good =
        std::isupper(static_cast<unsigned char>(letter)) != 0 && fault == std::errc{} && std::isfinite(value);
    if (!good)
      return block.refusal("not-a-word",
                           "'" + text.substr(begin, 12) + "' is no word with a number: write out variables and calls");
    if (isPlace(letter) && std::abs(value) > kFurthest)
      return block.refusal("too-far",
                           "'" + text.substr(begin, 12) + "' is further than any machine reaches: correct it");
    at = static_cast<std::size_t>(end - text.data());
    const bool twice = letter != 'G' && letter != 'M' && block.has(letter);
    if (twice) return block.refusal("word-twice", std::string{"a second word "} + letter + ": remove one");
    if (letter == 'G') {
      block.g_.push_back(value);
    } else if (letter == 'M') {
      block.m_.push_back(value);
    } else {
      block.words_.push_back({letter, value, text.substr(begin, at - begin), false});
    }
  }
  return block;
}

const Block::Word* Block::find(char letter) const {
  const auto found =
      std::ranges::find_if(words_, [&](const Word& word) { return word.letter == letter && !word.taken; });
  return found == words_.end() ? nullptr : &*found;
}

std::optional<double> Block::take(char letter) {
  for (auto& word : words_) {
    if (word.letter != letter || word.taken) continue;
    word.taken = true;
    return word.value;
  }
  return std::nullopt;
}

std::optional<std::string> Block::leftOver() const {
  const auto found = std::ranges::find(words_, false, &Word::taken);
  return found == words_.end() ? std::nullopt : std::optional{found->text};
}

}  // namespace probebox::interference
