#include "firmware/metrology/screw/screw_config.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/digits.hpp"

namespace probebox::metrology {
namespace {

// (D3): the means of a whole turn sum to 0. A part of a table, one in another unit, or one with a gross error does not.
std::optional<Refusal> notWhole(const std::vector<double>& values, double sd_sector_um) {
  constexpr double kUsualSd_um = 0.02;  // of a sector, where none is stated
  constexpr double kMost = 5.0;         // sd
  const auto count = static_cast<double>(values.size());
  double digit = 1.0;
  for (const double value : values) digit = std::min(digit, digitOf(value));
  const double sum = std::accumulate(values.begin(), values.end(), 0.0);
  const double limit = kMost * std::max(sd_sector_um, kUsualSd_um) * std::sqrt(count) + count * digit / 2.0;
  if (std::abs(sum) <= limit) return std::nullopt;
  return Refusal{"bad-sectors", "the values of table 'sector_table' sum to " + text(sum) +
                                    " um, and those of a whole turn to 0 within " + text(limit) +
                                    ": give all sectors of the table of screw-calibration, in um"};
}

}  // namespace

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

std::optional<Refusal> refuseOutside(const ScrewModel& screw, const Table& table, std::string_view column) {
  // Bearings, nut and stated lengths take a little of it at both ends.
  constexpr double kBeyond = 0.05;
  const auto& positions = *table.column(column);
  for (std::size_t row = 0; row < positions.size(); ++row) {
    const double signed_lever = leverOf(screw, positions[row]);
    const double lever = screw.reversed ? -signed_lever : signed_lever;
    if (lever >= -kBeyond && lever <= 1 + kBeyond) continue;
    return Refusal{"outside-screw", "table '" + table.name + "', row " + std::to_string(row + 1) + ": at " +
                                        std::string{column} + " = " + text(positions[row]) + " mm the nut is " +
                                        text(lever * screw.length_mm) + " mm from the fixed bearing of a screw of " +
                                        text(screw.length_mm) +
                                        " mm: give x_mm, orgoff_mm and screw_length_mm in mm, and check axis_reversed"};
  }
  return std::nullopt;
}

std::optional<Refusal> fillSectors(ScrewModel& screw, const Table& table, double sd_sector_um) {
  const auto& numbers = *table.column("sector");
  const auto& values = *table.column(kSectorColumns[1]);
  const Refusal bad{"bad-sectors", "table 'sector_table' must name the sectors 0 to n - 1, each once, at least " +
                                       std::to_string(kLeastSectors) + " and at most " + std::to_string(kMostSectors) +
                                       ": take the table of screw-calibration"};
  if (numbers.size() < kLeastSectors || numbers.size() > kMostSectors) return bad;
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
  return notWhole(values, sd_sector_um);
}

}  // namespace probebox::metrology
