#include "board/describe/spelling.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <numeric>
#include <utility>
#include <vector>

namespace probebox::board {
namespace {

// Longest first, so that "_mm_s2" is not taken for "_s2" or "_mm".
constexpr std::array<std::string_view, 38> kUnitSuffixes{"_counts_per_mm",
                                                         "_nm_per_count",
                                                         "_um_per_s",
                                                         "_mm_per_s",
                                                         "_mm_min",
                                                         "_per_mm",
                                                         "_mm_s2",
                                                         "_m_min",
                                                         "_um_s",
                                                         "_mm_s",
                                                         "_m_s2",
                                                         "_m_s",
                                                         "_inch",
                                                         "_khz",
                                                         "_mhz",
                                                         "_deg",
                                                         "_rad",
                                                         "_ppm",
                                                         "_ppb",
                                                         "_min",
                                                         "_hz",
                                                         "_ns",
                                                         "_us",
                                                         "_ms",
                                                         "_nm",
                                                         "_um",
                                                         "_mm",
                                                         "_cm",
                                                         "_in",
                                                         "_ft",
                                                         "_kg",
                                                         "_mv",
                                                         "_s",
                                                         "_h",
                                                         "_m",
                                                         "_k",
                                                         "_c",
                                                         "_v"};

std::pair<std::string_view, std::string_view> stemAndUnit(std::string_view key) {
  for (const auto unit : kUnitSuffixes) {
    if (key.size() > unit.size() && key.ends_with(unit)) {
      return {key.substr(0, key.size() - unit.size()), unit.substr(1)};
    }
  }
  return {key, {}};
}

std::size_t editDistance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 0; i < a.size(); ++i) {
    std::size_t diagonal = std::exchange(row[0], i + 1);
    for (std::size_t j = 0; j < b.size(); ++j) {
      const std::size_t replaced = diagonal + (a[i] == b[j] ? 0 : 1);
      diagonal = row[j + 1];
      row[j + 1] = std::min({replaced, row[j] + 1, row[j + 1] + 1});
    }
  }
  return row.back();
}

std::string lowerCase(std::string_view text) {
  std::string lower{text};
  for (auto& letter : lower) letter = static_cast<char>(std::tolower(static_cast<unsigned char>(letter)));
  return lower;
}

std::string doubtfulUnit(std::string_view given, std::string_view read, const std::string& key) {
  const std::string named = given.empty() ? "the key names no unit" : "the key says " + std::string{given};
  return named + ", and this value is in " + std::string{read} + ": convert it and write '" + key + "'";
}

}  // namespace

Suggestion suggest(std::string_view unknown, const std::set<std::string, std::less<>>& known) {
  const auto [stem, unit] = stemAndUnit(unknown);
  Suggestion best;
  std::size_t distance = std::max<std::size_t>(2, unknown.size() / 3) + 1;
  for (const auto& key : known) {
    if (lowerCase(key) == lowerCase(unknown)) return {key, "names are told apart by capitals: write '" + key + "'"};
    const auto [known_stem, known_unit] = stemAndUnit(key);
    if (known_stem == stem && !known_unit.empty()) return {key, doubtfulUnit(unit, known_unit, key)};
    // A name cut short is nearer than its missing letters say.
    const bool shortened = unknown.size() >= 3 && key.starts_with(unknown);
    const auto edits = shortened ? std::size_t{1} : editDistance(unknown, key);
    if (edits >= distance) continue;
    distance = edits;
    best = {key, "did you mean '" + key + "'?"};
  }
  return best;
}

std::optional<std::string> nearest(std::string_view given, const std::vector<std::string>& known) {
  constexpr std::size_t kShortest = 3;  // of fewer letters, everything is a misspelling of everything
  if (given.size() < kShortest || std::ranges::find(known, given) != known.end()) return std::nullopt;
  std::optional<std::string> best;
  std::size_t distance = std::max<std::size_t>(1, given.size() / 3) + 1;
  for (const auto& word : known) {
    const auto edits = editDistance(lowerCase(given), lowerCase(word));
    if (edits >= distance) continue;
    distance = edits;
    best = word;
  }
  return best;
}

}  // namespace probebox::board
