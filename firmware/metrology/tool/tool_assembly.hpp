#pragma once
#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/method.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::metrology {

// Method "tool-assembly": length and offset of a tool in its holder, and the differences from the stored lengths
// (CN103801980, docs/metrology.md C1, C2, C3). Table readings{workpiece_variant,rep,W0_x_mm,W0_y_mm,L0_z_mm}: machine
// coordinates at contact, zero where the holder's reference coincides with that of the measuring unit; variant 1
// touches a workpiece instead of the unit's own faces. Config: L1_mm (holder), L2_mm (tool), part_mm (g, needed for
// variant 1); holder_id, tool_id; sigma_mm; sd_L1_mm, sd_L2_mm, sd_part_mm; spread_limit_mm (default 0.2),
// compensation_limit_mm (default 5), assembled_max_mm. Gives assembled_length_mm (L3) and compensation_mm (W2x, W2y,
// L4); also gauge_length_mm (L3 + L1). With tables holder_store and tool_store (tool_store.hpp) the lengths come from
// there, and the records for motion control and simulation go back. approach_side: -1 where the machine counts Z
// against the tool (default +1). Table faces{axis,touched,configured}, where wanted: the number of the face that each
// axis touched. Refuses: missing-key, missing-id, duplicated-id, bad-variant, bad-face, wrong-face, spread-too-large,
// length-not-positive (L0 or L3), length-too-large, compensation-too-large.
Outcome<Result, Refusal> solveToolAssembly(const Dataset& dataset);

namespace quantity {

// From the gauge line, L3 + L1 (C2): the length of the assembled tool in use.
inline constexpr Quantity kGaugeLength{.key = result_key::kGaugeLength};
inline constexpr Quantity kAssembledLength{.key = result_key::kAssembledLength, .about = "L3 (C2)"};

inline constexpr Quantity kCompensation{
    .key = result_key::kCompensation,
    .about = "W2x, W2y, L4: of the spindle axis from the tip; to add to its commanded position and the length in store",
    .axes = "XYZ"};

}  // namespace quantity

extern const Method kToolAssembly;

}  // namespace probebox::metrology
