#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/store/record.hpp"
#include "protocol/messages/results.hpp"

// Values of results, independent of the method.
namespace probebox::app {

// Appends every promised value under a unique name: centre_mm[0]; EXC_at_60_deg_mm for subject rotary-c.
void appendAll(const metrology::Result& result, const std::string& subject, std::vector<messages::NamedValue>& values);

// Offset of the stylus tip from the spindle axis at A = 0, x y, mm, under the key stylus_offset_mm; nothing if the
// result has none.
std::optional<metrology::Estimate> stylusOffsetOf(const metrology::Result& result);

// Number of the tool that carries the probe, as stated by the case (probe_tool); 1 by default.
std::uint32_t probeToolOf(const metrology::Result& result);

// "stylus-offset-3".
std::string stylusOffsetSubject(std::uint32_t probe_tool);

// Converts a centreline relative to the stylus tip to one relative to the spindle axis by adding the stylus offset.
// Standard deviations are combined; without that of the offset a value has none. The original is kept as tip_centre_mm,
// the offset as stylus_offset_in_force_mm, which marks the result as converted. Nothing if it has no centre_mm.
std::optional<metrology::Result> relativeToSpindle(metrology::Result from_tip, const metrology::Estimate& offset,
                                                   store::Id offset_id);

}  // namespace probebox::app
