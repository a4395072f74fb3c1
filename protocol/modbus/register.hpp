#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "protocol/state/served_results.hpp"
#include "protocol/state/snapshot.hpp"

// One entry of the register map, and how it names the value that it shows.
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

// The state of the box from which the registers of one answer are computed.
struct RegisterInputs {
  const published::Snapshot& state;
  const published::LineState& line;
  const published::ServedResults& results;          // in force
  std::array<double, kLinearAxes> correction_mm{};  // served: finite and within kCorrectionLimitMm
  std::uint16_t status{};                           // register 2
};

// Value of a register, in its unit. part: which of a row of several registers, such as the axis.
using ValueOf = double (*)(const RegisterInputs& inputs, std::size_t part);

struct Register {
  std::uint16_t address;
  std::string_view name;
  Kind kind;
  double scale;           // one count is this many `unit`
  std::string_view unit;  // empty: a plain number
  Access access;
  std::string_view meaning;
  ValueOf value{};  // null: written by the master, or a value of a result
  // For a table: number of rows, numbered from 1, and registers from one row to the next.
  std::uint16_t rows{1};
  std::uint16_t row_registers{};
  std::uint8_t part{};

  std::size_t end() const;  // after its last row
};

namespace detail {
// Follows pointers to members, and in each array on the way the element `part`.
template <auto... path>
constexpr auto walk(const auto& value, std::size_t part);

template <auto head, auto... rest>
constexpr auto step(const auto& value, std::size_t part) {
  return walk<rest...>(value.*head, part);
}

template <auto... path>
constexpr auto walk(const auto& value, std::size_t part) {
  if constexpr (requires { value[part]; }) {
    return walk<path...>(value[part], part);
  } else if constexpr (sizeof...(path) > 0) {
    return step<path...>(value, part);
  } else {
    return value;
  }
}

template <auto head, auto... rest>
constexpr auto found(const RegisterInputs& inputs, std::size_t part) {
  if constexpr (requires { inputs.state.*head; }) {
    return step<head, rest...>(inputs.state, part);
  } else {
    return step<head, rest...>(inputs.line, part);
  }
}
}  // namespace detail

// The value at the end of a path of members of Snapshot or LineState, such as of<&Snapshot::axes,
// &AxisState::extension_um>, which is the extension of axis `part`.
template <auto... path>
double of(const RegisterInputs& inputs, std::size_t part) {
  return static_cast<double>(detail::found<path...>(inputs, part));
}

// Counters and numbers of results go round; everything else saturates.
template <auto... path>
double wraps16(const RegisterInputs& inputs, std::size_t part) {
  return static_cast<double>(detail::found<path...>(inputs, part) & 0xFFFFU);
}
template <auto... path>
double wraps32(const RegisterInputs& inputs, std::size_t part) {
  return static_cast<double>(detail::found<path...>(inputs, part) & 0xFFFFFFFFU);
}

// A bit for each element of an array, set where the element, or the end of a path from it, is true.
template <auto array, auto... path>
double bits(const RegisterInputs& inputs, std::size_t) {
  unsigned set = 0;
  const auto& all = inputs.state.*array;
  for (std::size_t i = 0; i < all.size(); ++i) set |= detail::walk<path...>(all[i], i) ? 1U << i : 0U;
  return set;
}

template <std::uint16_t number>
double constant(const RegisterInputs&, std::size_t) {
  return number;
}

}  // namespace probebox::modbus
