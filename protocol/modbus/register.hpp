#pragma once
#include <cstddef>
#include <cstdint>
#include <string_view>

// One entry of the register map.
namespace probebox::modbus {

enum class Kind : std::uint8_t {
  u16,
  i16,
  offset_i16,  // i16 + 32768, for masters without signs
  u32,
  i32,
  f32,  // IEEE 754
};
constexpr std::size_t registersOf(Kind kind) {
  return kind >= Kind::u32 ? 2 : 1;
}

enum class Access : std::uint8_t { read, write };  // what can be written can be read back

// Order of the two registers of a 32-bit value.
enum class WordOrder : std::uint8_t { high_first = 0, low_first = 1 };

struct Register {
  std::uint16_t address;
  std::string_view name;
  Kind kind;
  double scale;           // one count is this many `unit`
  std::string_view unit;  // empty: a plain number
  Access access;
  std::string_view meaning;
  // For a table: number of rows, numbered from 1, and registers from one row to the next.
  std::uint16_t rows{1};
  std::uint16_t row_registers{};

  std::size_t end() const;  // after its last row
};

}  // namespace probebox::modbus
