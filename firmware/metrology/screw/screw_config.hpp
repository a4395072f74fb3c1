#pragma once
#include <array>
#include <cstddef>
#include <optional>
#include <string_view>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/metrology/live/screw_model.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

inline constexpr MethodKey kScrewLength{
    "screw_length_mm", kNeeded, "from the fixed bearing to the sensor", {}, 10, 1e5};
inline constexpr MethodKey kScrewOffset{"orgoff_mm", kNeeded, "from the fixed bearing to the axis zero"};
inline constexpr MethodKey kAxisReversed{"axis_reversed", "false",
                                         "true if the axis counts upwards towards the fixed bearing"};
inline constexpr KnownQuantity kScrewLengthKnown{"sd_screw_length_mm", "screw_length_mm", KnownKind::value, false,
                                                 "length of the screw"};
inline constexpr KnownQuantity kScrewOffsetKnown{"sd_orgoff_mm", "orgoff_mm", KnownKind::value, false,
                                                 "distance of the fixed bearing"};
inline constexpr std::string_view kEvenHeat =
    "a temperature that varies along the screw: the sensor measures the extension of its whole length";

// Reads length, offset and sense of a screw: config screw_length_mm, orgoff_mm, axis_reversed. Refuses: missing-key,
// bad-config.
Outcome<ScrewModel, Refusal> screwOf(const Dataset& dataset);

// Refuses a position at which the nut is not on the screw: outside-screw, by table, row and remedy.
std::optional<Refusal> refuseOutside(const ScrewModel& screw, const Table& table,
                                     std::string_view positions = column::kX);

// Columns of table sector_table: the face table of screw-calibration.
inline constexpr MethodColumn kSectorColumns[]{column::number("sector"), {"T_um", ColumnRole::face, 500}};
// Columns of table gain_cal: extensions of the screw's free end, and errors of the nut that go with them.
inline constexpr MethodColumn kExtension{"ext_um", ColumnRole::given};
inline constexpr MethodColumn kNutError{"error_um", ColumnRole::given};
inline constexpr double kLeastExtension_um = 5;  // from the least to the greatest, which tells a gain
inline constexpr std::size_t kLeastSectors = 2;
// Takes the sectors of a screw from that table. sd_sector_um: of a value; 0: not stated. Refuses: bad-sectors (not each
// of 0 to n - 1 once, or a sum that is not 0).
std::optional<Refusal> fillSectors(ScrewModel& screw, const Table& table, double sd_sector_um);

}  // namespace probebox::metrology
