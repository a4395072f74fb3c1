#include "board/describe/shank_sections.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

#include "board/describe/tool_sections.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::board {
namespace {

constexpr Range kRadius_mm{0.1, 100};
constexpr Range kHeight_mm{0.1, kMostToolLength_mm};
// Two lengths must differ by 10 mm to tell a direction.
constexpr Range kTouchingHeight_mm{10, kMostToolLength_mm};
// A ball is set up by hand, so it is touched a little above or below the height.
constexpr double kBeside_mm = 1;

void checkLength(Section& section, const ProbeShankDescription& shank, const Machine& machine) {
  const auto tool = std::ranges::find(machine.tools, shank.tool, &ToolDescription::number);
  if (tool == machine.tools.end()) {
    section.problem("tool", "= " + std::to_string(shank.tool) +
                                " is no [[tool]]: add it, with the length down to the stylus' ball");
  } else if (section.good("to_mm") && shank.to_mm > tool->length_mm) {
    section.problem("to_mm", "is above the gauge line of tool " + std::to_string(shank.tool) +
                                 ": count heights from the middle of the stylus' ball");
  }
}

ProbeShankDescription readDescribedShank(Section section, const Machine& machine) {
  ProbeShankDescription shank;
  shank.tool = static_cast<std::uint32_t>(section.integer("tool", kToolNumbers));
  shank.radius_mm = section.number("radius_mm", kRadius_mm);
  shank.from_mm = section.number("from_mm", kHeight_mm);
  shank.to_mm = section.number("to_mm", kHeight_mm);
  shank.height_mm = section.number("height_mm", kTouchingHeight_mm);
  if (section.good("tool")) checkLength(section, shank, machine);
  checkEnds(section, shank.from_mm, shank.to_mm);
  const bool on_it = shank.height_mm >= shank.from_mm + kBeside_mm && shank.height_mm <= shank.to_mm - kBeside_mm;
  if (section.good("height_mm") && section.good("from_mm") && section.good("to_mm") && !on_it)
    section.problem("height_mm",
                    "is not on the shank: choose a height between 'from_mm' and 'to_mm', 1 mm away from either");
  section.finish();
  return shank;
}

}  // namespace

void readProbeShank(Section& root, Machine& machine) {
  if (auto section = root.sectionIfThere("probe_shank"))
    machine.probe_shank = readDescribedShank(std::move(*section), machine);
}

void checkEnds(Section& section, double from_mm, double to_mm) {
  if (section.good("from_mm") && section.good("to_mm") && from_mm >= to_mm)
    section.problem("to_mm", "is not above 'from_mm': exchange them");
}

}  // namespace probebox::board
