#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

// Places in the map of the values of results that the core does not use. Registers, pages and the image come from this
// one definition.
namespace probebox::modbus {

enum class ValueUnit : std::uint8_t { mm, um, rad, number };

// One value of a result: the first of its keys that the result has. An index counts within the key's values.
struct ValueKey {
  std::string_view key;
  std::uint8_t index{};
};
struct BlockValue {
  std::string_view name;
  ValueUnit unit{};
  std::array<ValueKey, 3> keys{};
};

// Layout of a block: values f32, their sd f32, values in mm also i32 in nm where `in_nm`, the number of the result u32,
// the number of the probe's tool u16, state u16.
struct ResultBlock {
  std::string_view subject;
  std::uint16_t first{};
  std::string_view title;
  std::span<const BlockValue> values;
  std::string_view meaning;  // of the first value
  bool in_nm{true};
  bool is_proposed{};  // of a result that nobody has accepted yet
};

// Layout of a row of a table by tool number: values f32 (mm), values i32 (nm), sd u16 (0.01 um), state u16 in the last
// of its registers.
struct ToolTable {
  std::string_view prefix;  // of the subject: "tool-"
  std::uint16_t first{};
  std::string_view title;
  std::span<const BlockValue> values;  // mm, up to 3
  std::string_view meaning;
};
inline constexpr std::uint16_t kMostToolNumber = 99;
inline constexpr std::uint16_t kRegistersOfTool = 16;

// Bits of a state register.
inline constexpr std::uint16_t kInForce = 1;
inline constexpr std::uint16_t kRestsOnRetired = 2;
inline constexpr unsigned kFirstKnownBit = 4;  // one for each value that the result has

std::span<const ResultBlock> resultBlocks();
std::span<const ToolTable> toolTables();

// Addresses inside a block.
struct BlockAddresses {
  std::uint16_t values{}, sd{}, nm{}, result{}, tool{}, state{}, end{};
};
constexpr BlockAddresses addressesOf(const ResultBlock& block) {
  const auto count = static_cast<std::uint16_t>(block.values.size());
  unsigned lengths = 0;
  for (const auto& value : block.values) lengths += block.in_nm && value.unit == ValueUnit::mm ? 1U : 0U;
  const auto after = [](std::uint16_t from, unsigned registers) {
    return static_cast<std::uint16_t>(from + registers);
  };
  BlockAddresses at{.values = block.first};
  at.sd = after(at.values, 2U * count);
  at.nm = after(at.sd, 2U * count);
  at.result = after(at.nm, 2 * lengths);
  at.tool = after(at.result, 2);
  at.state = after(at.tool, 1);
  at.end = after(at.state, 1);
  return at;
}

// Addresses inside a row, for tool 1.
constexpr BlockAddresses addressesOf(const ToolTable& table) {
  const auto count = static_cast<std::uint16_t>(table.values.size());
  const auto after = [](std::uint16_t from, unsigned registers) {
    return static_cast<std::uint16_t>(from + registers);
  };
  BlockAddresses at{.values = table.first};
  at.nm = after(at.values, 2U * count);
  at.sd = after(at.nm, 2U * count);
  at.state = after(table.first, kRegistersOfTool - 1U);
  at.end = after(table.first, kRegistersOfTool);
  return at;
}

}  // namespace probebox::modbus
