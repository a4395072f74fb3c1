#include "tools/gcode/loop/areas.hpp"

#include <algorithm>
#include <array>
#include <map>

#include "protocol/modbus/map.hpp"
#include "protocol/modbus/page.hpp"

namespace probebox::gcode::loop {
namespace {

namespace address = modbus::address;

constexpr std::uint16_t kWritten = 256;  // word from which on written areas lie

// Words are even, so that 32-bit values lie at multiples of four bytes.
constexpr std::array kRead = std::to_array<Area>({
    {.first = address::magic, .count = 13, .word = 0},
    {.first = address::calibration_state, .count = 9, .word = 14},
    {.first = address::home_position, .count = 28, .word = 24},
    {.first = address::pose_angle, .count = 11, .word = 52},
    {.first = address::request_of, .count = 106, .word = 64},
});
constexpr std::array kWrittenAreas = std::to_array<Area>({
    {.first = address::home_position, .count = 8, .word = kWritten, .commit = address::home_commit},
    {.first = address::inhibit, .count = 1, .word = kWritten + 8, .commit = address::inhibit},
    {.first = address::marker_run, .count = 14, .word = kWritten + 10, .commit = address::marker_commit},
    {.first = address::pose_angle, .count = 11, .word = kWritten + 24, .commit = address::pose_commit},
    {.first = address::request_method, .count = 22, .word = kWritten + 36, .commit = address::request_commit},
    {.first = address::request_contacts, .count = 1, .word = kWritten + 58, .commit = address::request_commit},
    {.first = address::request_of, .count = 4, .word = kWritten + 60, .commit = address::request_commit},
});

const modbus::Register* entryOf(std::string_view pin) {
  static const auto all = [] {
    std::map<std::string, const modbus::Register*, std::less<>> entries;
    for (const auto& entry : modbus::registers()) entries.emplace(modbus::halPinOf(entry), &entry);
    return entries;
  }();
  const auto found = all.find(pin);
  return found == all.end() ? nullptr : found->second;
}

std::optional<Place> placeIn(std::span<const Area> areas, std::string_view pin) {
  const auto* entry = entryOf(pin);
  if (entry == nullptr) return std::nullopt;
  for (const auto& area : areas) {
    if (entry->address < area.first || entry->address + registersOf(entry->kind) > area.first + area.count + 0U)
      continue;
    return Place{entry, static_cast<std::uint16_t>(area.word + entry->address - area.first)};
  }
  return std::nullopt;
}

}  // namespace

std::span<const Area> areasRead() {
  return kRead;
}

std::span<const Area> areasWritten() {
  return kWrittenAreas;
}

std::optional<Place> placeRead(std::string_view pin) {
  return placeIn(kRead, pin);
}

std::optional<Place> placeWritten(std::string_view pin) {
  return placeIn(kWrittenAreas, pin);
}

bool ofStep(std::string_view pin) {
  return pin.starts_with("probebox.step-") && entryOf(pin) != nullptr;
}

}  // namespace probebox::gcode::loop
