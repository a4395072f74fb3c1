#include "firmware/corrections/corrections.hpp"

namespace probebox::corrections {

published::ToolInSamples Corrections::toolInSamples(MonoTime now) const {
  published::ToolInSamples tool{.axes = {}, .tool = state_.swivel.tool, .angles_rad = {}};
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    const auto offset_mm = references_[axis].position_mm(0.0);
    const auto& screw = screws_[axis];
    tool.axes[axis] = {.referenced = offset_mm.has_value(),
                       .has_screw = screw.fitted(),
                       .screw_known = screw.extensionKnown(now),
                       .offset_mm = offset_mm.value_or(0),
                       .screw_mm = screw.offset_mm(),
                       .screw_slope = screw.slope()};
  }
  for (std::size_t axis = 0; axis < kRotaryAxes; ++axis)
    if (state_.rotary[axis].known) tool.angles_rad[axis] = state_.rotary[axis].angle_rad;
  return tool;
}

}  // namespace probebox::corrections
