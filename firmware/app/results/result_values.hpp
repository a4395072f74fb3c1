#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "firmware/metrology/dataset/result.hpp"
#include "firmware/store/record.hpp"
#include "protocol/messages/results.hpp"
#include "protocol/units/outcome.hpp"

// Values of results, independent of the method.
namespace probebox::app {

// Appends every promised value under a unique name: centre_mm[0]; deviation_XC_at_60_deg_mm for subject rotary-c.
void appendAll(const metrology::Result& result, const std::string& subject, std::vector<messages::NamedValue>& values);

// Combined standard uncertainties of its values; type A alone where the result states no others; empty without any.
std::span<const double> uncertaintiesOf(const metrology::Estimate& estimate);

// Values of one key with these uncertainties, 0 where there is none.
struct Values {
  std::span<const double> values;
  std::span<const double> sd;

  double sdOf(std::size_t i) const { return i < sd.size() ? sd[i] : 0.0; }
};
// count: how many there have to be; 0 for any number. The error names the key: it is missing, or a value is not finite.
Outcome<Values> valuesOf(const metrology::Result& result, std::string_view key, std::size_t count);

// The probe's gain that a result about a delay brings into force; null if there is none, if its uncertainty is unknown,
// or if the case did not state the angle A at which the probe touched, because the gain may then be that of a turned
// probe.
const metrology::Estimate* servedGain(const metrology::Result& result);

// Offset of the stylus tip from the spindle axis at A = 0, x y, mm, under the key stylus_offset_mm; nothing if the
// result has none.
std::optional<metrology::Estimate> stylusOffsetOf(const metrology::Result& result);

// Number of the tool that carries the probe, as stated by the case (probe_tool); 1 by default.
std::uint32_t probeToolOf(const metrology::Result& result);

// Converts a centreline relative to the stylus tip to one relative to the spindle axis by adding the stylus offset.
// Standard deviations are combined; without that of the offset a value has none. The original is kept as tip_centre_mm,
// the offset as stylus_offset_in_force_mm, which marks the result as converted. Nothing if it has no centre_mm.
std::optional<metrology::Result> relativeToSpindle(metrology::Result from_tip, const metrology::Estimate& offset,
                                                   store::Id offset_id);

}  // namespace probebox::app
