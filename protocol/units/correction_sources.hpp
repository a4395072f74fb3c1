#pragma once
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <string_view>

// The sources that the corrections are summed from, as descriptions, messages and registers name them.
namespace probebox {

// Bits of the mask of sources. Never change them.
enum class SourceKind : std::uint8_t { screw = 0, swivel = 1, rotary = 2, centreline = 3 };

struct SourceDescription {
  std::string_view name;
  std::string_view section;  // of machine.toml, without which it can never be good; empty: it needs no description
  std::string_view lacking;  // what machine.toml has not without that section, and the remedy
};
inline constexpr SourceDescription kSources[]{{"screw", "screw", "no screw: add [screw.X]"},
                                              {"swivel", "swivel", "no swivelling head: add [swivel]"},
                                              {"rotary", "rotary_table", "no rotary table: add [rotary_table]"},
                                              {"centreline", "", ""}};
inline constexpr std::size_t kSourceKinds = std::size(kSources);
// As registers and messages tell the mask.
inline constexpr char kSourceBits[] = "sources of corrections: bit 0 screw, 1 swivel, 2 rotary, 3 centreline";

constexpr std::uint16_t bitOf(SourceKind kind) {
  return static_cast<std::uint16_t>(1U << static_cast<unsigned>(kind));
}
constexpr bool hasSource(std::uint16_t mask, std::size_t kind) {
  return (unsigned{mask} >> kind & 1U) != 0;
}

}  // namespace probebox
