#include "protocol/units/nearest.hpp"

#include <algorithm>
#include <vector>

namespace probebox {
namespace {

// Optimal string alignment distance: insertions, deletions, substitutions, swaps of neighbours.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) d[i][0] = i;
  for (std::size_t j = 0; j <= b.size(); ++j) d[0][j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t change = a[i - 1] == b[j - 1] ? 0 : 1;
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, d[i - 1][j - 1] + change});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
    }
  }
  return d[a.size()][b.size()];
}

bool begins(std::string_view known, std::string_view word) {
  return word.size() >= 3 && known.starts_with(word);
}

}  // namespace

std::string nearest(std::string_view word, std::span<const std::string> known) {
  if (word.size() > 64) return {};
  const std::string* best = nullptr;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 3) + 1;
  for (const auto& candidate : known) {
    const auto d = begins(candidate, word) ? 1 : distance(word, candidate);
    if (d < best_distance && d < candidate.size()) best = &candidate, best_distance = d;
  }
  return best == nullptr ? std::string{} : *best;
}

std::string didYouMean(std::string_view word, std::span<const std::string> known) {
  const auto meant = nearest(word, known);
  return meant.empty() ? std::string{} : "; did you mean " + meant + "?";
}

std::string didYouMean(std::string_view word, std::span<const std::string_view> known) {
  return didYouMean(word, std::vector<std::string>{known.begin(), known.end()});
}

}  // namespace probebox
