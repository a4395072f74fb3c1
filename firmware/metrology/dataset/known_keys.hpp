#pragma once
#include <array>
#include <span>
#include <string_view>
#include <vector>

namespace probebox::metrology {

// Kind of a known quantity, which determines how its error acts.
enum class KnownKind {
  size,   // a length of a piece: expands with temperature
  value,  // a number of the configuration that is not a workpiece size
  table,  // all coordinates of the table with this name
};

struct KnownQuantity {
  std::string_view method;
  std::string_view sd_key;
  std::string_view key;  // key of the uncertain quantity
  KnownKind kind{KnownKind::size};
  bool in_sd{};
};

// All quantities that methods take as known and cannot determine from their readings.
std::span<const KnownQuantity> knownQuantities();
// Tests whether a method uses the size of a workpiece, which expands with temperature.
bool hasSize(std::string_view method);

inline constexpr std::array<std::string_view, 3> kTemperatureKeys{"expansion_per_k", "sd_expansion_per_k",
                                                                  "sd_temperature_k"};

// Keys sd_<known quantity> of the method, and those of the temperature: see docs/metrology.md, "Uncertainty".
std::vector<std::string_view> typeBKeys(std::string_view method);

// Tests whether a key states a type B input of this method.
bool isTypeBKey(std::string_view method, std::string_view key);

}  // namespace probebox::metrology
