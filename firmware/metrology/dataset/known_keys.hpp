#pragma once
#include <array>
#include <span>
#include <string_view>
#include <vector>

namespace probebox::metrology {

// What kind of thing a known quantity is, which says how it may be wrong.
enum class KnownKind {
  size,   // a length of a piece: expands with temperature
  value,  // a number of the configuration, no piece
  table,  // every coordinate of the table of that name
};

struct KnownQuantity {
  std::string_view method;
  std::string_view sd_key;
  std::string_view key;  // of what is uncertain
  KnownKind kind{KnownKind::size};
  bool in_sd{};
};

// Every quantity that some method rests on and that its readings do not tell.
std::span<const KnownQuantity> knownQuantities();
// Whether the method rests on a length of a piece, which expands.
bool hasSize(std::string_view method);

inline constexpr std::array<std::string_view, 3> kTemperatureKeys{"expansion_per_k", "sd_expansion_per_k",
                                                                  "sd_temperature_k"};

// Keys sd_<known quantity> of the method, and of the temperature: see docs/metrology.md, "Uncertainty".
std::vector<std::string_view> typeBKeys(std::string_view method);

// Whether a key states a type B input of this method.
bool isTypeBKey(std::string_view method, std::string_view key);

}  // namespace probebox::metrology
