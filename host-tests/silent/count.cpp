#include "host-tests/silent/count.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <stdexcept>
#include <vector>

#include "firmware/metrology/dataset/method_parts.hpp"
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

bool names(const std::string& sentence, const Errors& errors) {
  const auto isSaid = [&](std::string_view words) { return says(sentence, words); };
  return std::ranges::any_of(errorKinds(), [&](const ErrorKind& error) {
    return errors.has(error.err) &&
           (std::ranges::any_of(error.causes, isSaid) || std::ranges::any_of(error.words, isSaid));
  });
}

// Names a cause that was not put in.
bool blames(const std::string& sentence, const Errors& errors) {
  const auto isOfThese = [&](const std::string& cause) {
    return std::ranges::any_of(errorKinds(), [&](const ErrorKind& error) {
      return errors.has(error.err) && std::ranges::find(error.causes, cause) != error.causes.end();
    });
  };
  return std::ranges::any_of(errorKinds(), [&](const ErrorKind& other) {
    return std::ranges::any_of(other.causes,
                               [&](const std::string& cause) { return !isOfThese(cause) && says(sentence, cause); });
  });
}

// Without what follows the name, and without numbers.
std::string beginningOf(const std::string& warning) {
  constexpr std::size_t kLongest = 48;
  std::string words = warning.substr(0, std::min(warning.find(": "), kLongest));
  std::erase_if(words, [](char c) { return c >= '0' && c <= '9'; });
  return words;
}

bool turnsC(const Dataset& dataset) {
  return std::ranges::any_of(dataset.tables, [](const Table& table) { return angleOfC(table) != nullptr; });
}

}  // namespace

void Cell::add(const SimulatedCase& simulated, const Errors& errors) {
  ++cases;
  const auto solved = solve(simulated.dataset);
  std::vector<std::string> sentences;
  if (solved.ok()) {
    sentences = solved->warnings;
    for (const auto& warning : sentences) ++words[beginningOf(warning)];
    const bool is_off = isOff(*solved, simulated.truth);
    off += is_off ? 1U : 0U;
    silent += is_off && sentences.empty() ? 1U : 0U;
  } else {
    sentences = {solved.error().name + " " + solved.error().reason};
    ++words["refused: " + solved.error().name];
    ++refused;
  }
  told += sentences.empty() ? 0U : 1U;
  named += std::ranges::any_of(sentences, [&](auto& sentence) { return names(sentence, errors); }) ? 1U : 0U;
  blamed += std::ranges::any_of(sentences, [&](auto& sentence) { return blames(sentence, errors); }) ? 1U : 0U;
}

void Cell::add(const Cell& other) {
  cases += other.cases, off += other.off, silent += other.silent, told += other.told, refused += other.refused,
      named += other.named, blamed += other.blamed;
  for (const auto& [word, times] : other.words) words[word] += times;
}

Draw each(Err err, bool states_noise) {
  return [=](Random&) { return Errors{.kinds = {err}, .states_noise = states_noise}; };
}

Draw mixed(bool states_noise) {
  return [=](Random& random) {
    std::vector<Err> kinds;
    for (const auto& error : errorKinds())
      if (error.err != Err::none && error.err != Err::diameters && error.err != Err::inches) kinds.push_back(error.err);
    std::ranges::shuffle(kinds, random);
    kinds.resize(2);
    return Errors{std::move(kinds), std::exp2(std::uniform_real_distribution{-1.0, 1.0}(random)), states_noise};
  };
}

Cell count(const World& world, const Draw& draw, std::uint64_t cases, std::uint64_t seed) {
  constexpr std::uint64_t kMostTries = 8;  // for each case
  Cell cell;
  Random random{seed};
  for (std::uint64_t tries = 0; cell.cases < cases && tries < kMostTries * cases; ++tries) {
    const Errors errors = draw(random);
    auto simulated = world.make(errors, random);
    if (!simulated || (errors.has(Err::run_out) && !turnsC(simulated->dataset))) continue;
    for (const auto& key : kMachineErrors) simulated->dataset.config.erase(key.key);
    if (!errors.states_noise) simulated->dataset.config.erase(std::string{key::kSigma.name});
    cell.add(*simulated, errors);
  }
  return cell;
}

}  // namespace probebox::metrology::silent
