#pragma once
#include <array>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/modbus/register.hpp"

// The parts from which registers() is assembled, by rising address.
namespace probebox::modbus {

// A row whose name contains such a token defines successive registers, one for each of the parts. Its meaning is that
// of the first; the others have "as" the first, or what stands behind bars in the meaning, the last as often as needed.
struct Series {
  std::string_view token;
  std::string_view parts;
};
inline constexpr std::array kSeries{Series{"XYZ", "XYZ"}, Series{"XY", "XY"}, Series{"ABC", "ABC"},
                                    Series{"1..8", "12345678"}, Series{"1..2", "12"}};
// Empty for a row that defines one register.
constexpr Series seriesIn(std::string_view name) {
  for (const auto& series : kSeries)
    if (name.find(series.token) != std::string_view::npos) return series;
  return {};
}

// Keeps a text for as long as the program runs: registers refer to it.
std::string_view kept(std::string text);

std::span<const Register> procedureRegisters();

// The registers of resultBlocks() and toolTables().
std::vector<Register> resultRegisters();

}  // namespace probebox::modbus
