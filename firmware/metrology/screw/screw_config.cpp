#include "firmware/metrology/screw/screw_config.hpp"

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

}  // namespace probebox::metrology
