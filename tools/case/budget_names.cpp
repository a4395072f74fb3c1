#include "tools/case/budget_names.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "firmware/metrology/dataset/pre_travel_shifts.hpp"
#include "firmware/metrology/dataset/stop_shifts.hpp"
#include "firmware/metrology/methods.hpp"
#include "protocol/units/machine_accuracy.hpp"

namespace probebox::casefolder {
namespace {

using Named = std::pair<std::string_view, std::string_view>;

// Causes that are no known quantity of one method.
constexpr auto kCauses = std::to_array<Named>({
    {metrology::kTemperatureKeys[2], "temperature of the sphere"},
    {metrology::kTemperatureKeys[1], "expansion of the sphere"},
    {metrology::kPreTravelBudget, "pre-travel of the probe"},
    {metrology::kTableStands.budget, "stop of the tilting table"},
    {metrology::kHeadStands.budget, "stop of the swivelling head"},
});

std::string_view wordsOf(std::string_view key) {
  for (const auto* method : metrology::allMethods()) {
    for (const auto& known : method->known)
      if (known.sd_key == key && !known.words.empty()) return known.words;
  }
  for (const auto& error : kMachineErrors) {
    if (error.key == key) return error.name;
  }
  const auto* cause = std::ranges::find(kCauses, key, &Named::first);
  return cause == kCauses.end() ? std::string_view{} : cause->second;
}

}  // namespace

std::string budgetName(std::string_view name) {
  const auto words = wordsOf(name.substr(0, name.find('[')));  // a part of several
  if (words.empty()) return std::string{name};
  return std::string{words} + (name.starts_with("sd_") ? " (" + std::string{name} + ")" : "");
}

std::string keyInWords(std::string key) {
  std::ranges::replace(key, '_', ' ');
  for (std::size_t k = 0; k < key.size(); ++k) {
    const bool alone = (k == 0 || key[k - 1] == ' ') && (k + 1 == key.size() || key[k + 1] == ' ');
    if (alone && key[k] >= 'x' && key[k] <= 'z') key[k] = static_cast<char>(key[k] - 'x' + 'X');
  }
  return key;
}

}  // namespace probebox::casefolder
