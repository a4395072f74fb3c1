// What corrections cannot be configured with, and what a configuration cannot follow.
#include <algorithm>
#include <array>
#include <optional>
#include <span>
#include <string>
#include <variant>

#include "firmware/corrections/corrections.hpp"

namespace probebox::corrections {

std::optional<Error> validate(const CorrectionsConfig& config) {
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const std::string name{"XYZ"[axis]};
    const auto& screw = config.screws[axis];
    if (screw.fitted && !(screw.model.length_mm > 0 && screw.model.pitch_mm > 0))
      return Error{"The screw of " + name + " needs a length and a pitch above 0: change [screw." + name +
                   "] in machine.toml."};
    if (!(config.limits[axis].size_mm >= 0 && config.limits[axis].rate_mm_s >= 0))
      return Error{"The correction limits of " + name + " cannot be negative: change [axis." + name +
                   "] in machine.toml."};
  }
  const bool any_screw = std::ranges::any_of(config.screws, &ScrewConfig::fitted);
  const std::array fitted{any_screw, config.swivel.fitted, config.rotary.fitted(), true};
  for (std::size_t kind = 0; kind < fitted.size(); ++kind) {
    if ((config.mask >> kind & 1U) != 0 && !fitted[kind])
      return Error{"sources names \"" + std::string{published::kSourceNames[kind]} + "\", but machine.toml describes " +
                   std::string{published::kLackingSections[kind]} + ", or remove it from sources."};
  }
  return std::nullopt;
}

std::optional<Error> validateActivation(const CorrectionsConfig& config, std::span<const Event> result) {
  if (result.empty()) return std::nullopt;
  const auto rows = result.subspan(1);
  if (const auto* swivel = std::get_if<SwivelActivated>(&result.front()))
    return SwivelSource::validateActivation(config.swivel, *swivel, rows);
  if (const auto* rotary = std::get_if<RotaryActivated>(&result.front()))
    return RotarySource::validateActivation(config.rotary, *rotary, rows);
  return std::nullopt;
}

}  // namespace probebox::corrections
