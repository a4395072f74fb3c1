#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/store/record.hpp"
#include "protocol/messages/results.hpp"

// Values of results, whichever method found them.
namespace probebox::app {

// Appends every promised value under a name of its own: centre_mm[0]; EXC_at_60_deg_mm of a subject rotary-c.
void appendAll(const metrology::Result& result, const std::string& subject, std::vector<messages::NamedValue>& values);

// Tip of the stylus from the spindle axis at A = 0, x y, mm, as key stylus_offset_mm; nothing where the result has
// none.
std::optional<metrology::Estimate> stylusOffsetOf(const metrology::Result& result);

// Number of the tool that carries the probe, as the case stated it (probe_tool); 1 where it did not.
std::uint32_t probeToolOf(const metrology::Result& result);

// "stylus-offset-3".
std::string stylusOffsetSubject(std::uint32_t probe_tool);

// A centreline from the stylus' tip with the offset of that stylus added: from the spindle axis. Standard deviations
// are combined; a value whose offset has none has none. The tip's own stays as tip_centre_mm, the offset as
// stylus_offset_in_force_mm, by which the store knows that it is added. Nothing where the result has no centre_mm.
std::optional<metrology::Result> relativeToSpindle(metrology::Result from_tip, const metrology::Estimate& offset,
                                                   store::Id offset_id);

}  // namespace probebox::app
