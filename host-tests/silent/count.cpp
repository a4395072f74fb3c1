#include "host-tests/silent/count.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "firmware/metrology/solve.hpp"
#include "protocol/units/machine_accuracy.hpp"

namespace probebox::metrology::silent {
namespace {

// Also without a value or its sd, where the truth is known.
bool isOff(const Estimate& found, const Truth& truth) {
  const auto& sd = found.uncertainty.empty() ? found.sd : found.uncertainty;
  for (std::size_t k = 0; k < truth.values.size(); ++k) {
    if (!std::isfinite(truth.values[k])) continue;
    if (k >= found.values.size() || k >= sd.size()) return true;
    if (!(std::abs(found.values[k] - truth.values[k]) <= 4 * sd[k])) return true;
  }
  return false;
}

bool isOff(const Result& result, const std::vector<Truth>& truth) {
  bool is_compared = false, is_off = false;
  for (const auto& each : truth) {
    const auto* found = result.find(each.key);
    if (found == nullptr) continue;
    is_compared = true;
    is_off = is_off || isOff(*found, each);
  }
  if (!is_compared) throw std::logic_error{"no truth of a result of " + result.method};
  return is_off;
}

// Not within a longer word.
bool says(const std::string& sentence, std::string_view words) {
  const auto isOfWord = [&](std::size_t at) {
    return at < sentence.size() && (std::isalnum(static_cast<unsigned char>(sentence[at])) != 0 || sentence[at] == '_');
  };
  for (auto at = sentence.find(words); at != std::string::npos; at = sentence.find(words, at + 1))
    if (!(at > 0 && isOfWord(at - 1)) && !isOfWord(at + words.size())) return true;
  return false;
}

bool names(const std::string& sentence, const ErrorKind& error) {
  const auto isSaid = [&](std::string_view words) { return says(sentence, words); };
  return std::ranges::any_of(error.causes, isSaid) || std::ranges::any_of(error.words, isSaid);
}

// Names a cause that was not put in.
bool blames(const std::string& sentence, const ErrorKind& error) {
  return std::ranges::any_of(errorKinds(), [&](const ErrorKind& other) {
    return std::ranges::any_of(other.causes, [&](const std::string& cause) {
      return std::ranges::find(error.causes, cause) == error.causes.end() && says(sentence, cause);
    });
  });
}

// Without what follows the name, and without numbers.
std::string beginningOf(const std::string& warning) {
  constexpr std::size_t kLongest = 48;
  std::string words = warning.substr(0, std::min(warning.find(": "), kLongest));
  std::erase_if(words, [](char c) { return c >= '0' && c <= '9'; });
  return words;
}

}  // namespace

void Cell::add(const Cell& other) {
  cases += other.cases, off += other.off, silent += other.silent, told += other.told, refused += other.refused,
      named += other.named, blamed += other.blamed;
  for (const auto& [word, times] : other.words) words[word] += times;
}

Cell count(const World& world, const ErrorKind& error, std::uint64_t cases, std::uint64_t seed) {
  Cell cell;
  Random random{seed};
  for (std::uint64_t k = 0; k < cases; ++k) {
    auto simulated = world.make(error.err, random);
    if (!simulated) return cell;
    for (const auto& key : kMachineErrors) simulated->dataset.config.erase(key.key);
    ++cell.cases;
    const auto solved = solve(simulated->dataset);
    std::vector<std::string> told;
    if (solved.ok()) {
      told = solved->warnings;
      for (const auto& warning : told) ++cell.words[beginningOf(warning)];
      const bool off = isOff(*solved, simulated->truth);
      cell.off += off ? 1U : 0U;
      cell.silent += off && told.empty() ? 1U : 0U;
    } else {
      told = {solved.error().name + " " + solved.error().reason};
      ++cell.words["refused: " + solved.error().name];
      ++cell.refused;
    }
    cell.told += told.empty() ? 0U : 1U;
    cell.named += std::ranges::any_of(told, [&](auto& words) { return names(words, error); }) ? 1U : 0U;
    cell.blamed += std::ranges::any_of(told, [&](auto& words) { return blames(words, error); }) ? 1U : 0U;
  }
  return cell;
}

}  // namespace probebox::metrology::silent
