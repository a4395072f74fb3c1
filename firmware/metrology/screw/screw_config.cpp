#include "firmware/metrology/screw/screw_config.hpp"

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {

Outcome<ScrewModel, Refusal> screwOf(const Dataset& dataset) {
  const auto length = requiredPositive(dataset, "screw_length_mm");
  if (!length) return length.error();
  const auto offset = requiredNumber(dataset, "orgoff_mm");
  if (!offset) return offset.error();
  const auto reversed = configSwitch(dataset, "axis_reversed");
  if (!reversed) return reversed.error();
  ScrewModel screw;
  screw.length_mm = length.value();
  screw.offset_mm = offset.value();
  screw.reversed = reversed.value();
  return screw;
}

}  // namespace probebox::metrology
