#include "firmware/metrology/screw/screw_config.hpp"

#include <cmath>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {

Outcome<ScrewModel, Refusal> screwOf(const Dataset& dataset) {
  TRY(const auto length, requiredPositive(dataset, "screw_length_mm"));
  TRY(const auto offset, requiredNumber(dataset, "orgoff_mm"));
  TRY(const auto reversed, configSwitch(dataset, "axis_reversed"));
  ScrewModel screw;
  screw.length_mm = length;
  screw.offset_mm = offset;
  screw.reversed = reversed;
  return screw;
}

std::optional<Refusal> refuseOutside(const ScrewModel& screw, const Table& table) {
  // Bearings, nut and stated lengths take a little of it at both ends.
  constexpr double kBeyond = 0.05;
  const auto& positions = *table.column("x_mm");
  for (std::size_t row = 0; row < positions.size(); ++row) {
    const double signed_lever = leverOf(screw, positions[row]);
    const double lever = screw.reversed ? -signed_lever : signed_lever;
    if (lever >= -kBeyond && lever <= 1 + kBeyond) continue;
    return Refusal{"outside-screw", "table '" + table.name + "', row " + std::to_string(row + 1) + ": at x = " +
                                        text(positions[row]) + " mm the nut is " + text(lever * screw.length_mm) +
                                        " mm from the fixed bearing of a screw of " + text(screw.length_mm) +
                                        " mm: give x_mm, orgoff_mm and screw_length_mm in mm, and check axis_reversed"};
  }
  return std::nullopt;
}

std::optional<Refusal> fillSectors(ScrewModel& screw, const Table& table) {
  const auto& numbers = *table.column("sector");
  const auto& values = *table.column("T_um");
  const Refusal bad{"bad-sectors", "table 'sector_table' must name the sectors 0 to n - 1, each once, at most " +
                                       std::to_string(kMostSectors) + ": take the table of screw-calibration"};
  if (numbers.size() > kMostSectors) return bad;
  std::vector<bool> seen(numbers.size(), false);
  for (std::size_t row = 0; row < numbers.size(); ++row) {
    const double number = numbers[row];
    if (number != std::floor(number) || number < 0.0 || number >= static_cast<double>(numbers.size())) return bad;
    const auto sector = static_cast<std::size_t>(number);
    if (seen[sector]) return bad;
    seen[sector] = true;
    screw.sector_um[sector] = values[row];
  }
  screw.sector_count = numbers.size();
  return std::nullopt;
}

}  // namespace probebox::metrology
