#include "host-tests/silent/count.hpp"

#include <algorithm>
#include <cmath>

#include "firmware/metrology/solve.hpp"
#include "protocol/units/machine_accuracy.hpp"

namespace probebox::metrology::silent {
namespace {

bool isOff(const Result& result, const Truth& truth) {
  const auto* found = result.find(truth.key);
  if (found == nullptr) return false;
  const auto& sd = found->uncertainty.empty() ? found->sd : found->uncertainty;
  for (std::size_t k = 0; k < std::min({truth.values.size(), found->values.size(), sd.size()}); ++k)
    if (std::abs(found->values[k] - truth.values[k]) > 4 * sd[k]) return true;
  return false;
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
      named += other.named;
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
      const bool off = std::ranges::any_of(simulated->truth, [&](const Truth& truth) { return isOff(*solved, truth); });
      cell.off += off ? 1U : 0U;
      cell.silent += off && told.empty() ? 1U : 0U;
    } else {
      told = {solved.error().name + " " + solved.error().reason};
      ++cell.words["refused: " + solved.error().name];
      ++cell.refused;
    }
    cell.told += told.empty() ? 0U : 1U;
    const auto names = [&](const std::string& words) {
      return std::ranges::any_of(error.named_by, [&](auto name) { return words.find(name) != std::string::npos; });
    };
    cell.named += std::ranges::any_of(told, names) ? 1U : 0U;
  }
  return cell;
}

}  // namespace probebox::metrology::silent
