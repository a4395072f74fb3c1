#include "board/describe/shank_sections.hpp"

#include <algorithm>
#include <cstdint>
#include <string>
#include <utility>

namespace probebox::board {
namespace {

constexpr Range kToolNumber{1, 65'535};
constexpr Range kRadius_mm{0.1, 100};
constexpr Range kHeight_mm{0.1, kMostToolLength_mm};
// Two lengths tell a direction from 10 mm apart on.
constexpr Range kTouchingHeight_mm{10, kMostToolLength_mm};
// A ball is set up by hand, so that it is touched a little beside the height.
constexpr double kBeside_mm = 1;

void checkEnds(Section& section, double from_mm, double to_mm) {
  if (section.has("from_mm") && section.has("to_mm") && from_mm >= to_mm)
    section.problem(*section.node("to_mm"), "'to_mm' is not above 'from_mm': exchange them");
}

void checkLength(Section& section, const ProbeShankDescription& shank, const Machine& machine) {
  const auto tool = std::ranges::find(machine.tools, shank.tool, &ToolDescription::number);
  if (tool == machine.tools.end()) {
    section.problem(*section.node("tool"), "there is no [[tool]] with number " + std::to_string(shank.tool) +
                                               ": add it, with the length down to the stylus' ball");
  } else if (section.has("to_mm") && shank.to_mm > tool->length_mm) {
    section.problem(*section.node("to_mm"), "'to_mm' is above the gauge line of tool " + std::to_string(shank.tool) +
                                                ": heights count from the middle of the stylus' ball");
  }
}

ProbeShankDescription readDescription(Section section, const Machine& machine) {
  ProbeShankDescription shank;
  shank.tool = static_cast<std::uint32_t>(section.integer("tool", kToolNumber));
  shank.radius_mm = section.number("radius_mm", kRadius_mm);
  shank.from_mm = section.number("from_mm", kHeight_mm);
  shank.to_mm = section.number("to_mm", kHeight_mm);
  shank.height_mm = section.number("height_mm", kTouchingHeight_mm);
  if (section.has("tool")) checkLength(section, shank, machine);
  checkEnds(section, shank.from_mm, shank.to_mm);
  const bool on_it = shank.height_mm >= shank.from_mm + kBeside_mm && shank.height_mm <= shank.to_mm - kBeside_mm;
  if (section.has("height_mm") && section.has("from_mm") && section.has("to_mm") && !on_it)
    section.problem(
        *section.node("height_mm"),
        "at 'height_mm' there is no shank: choose a height between 'from_mm' and 'to_mm', 1 mm from either");
  section.finish();
  return shank;
}

WorldShank readEmulated(Section section) {
  WorldShank shank;
  shank.radius_mm = section.number("radius_mm", kRadius_mm);
  shank.from_mm = section.number("from_mm", kHeight_mm);
  shank.to_mm = section.number("to_mm", kHeight_mm);
  shank.offset_mm = {section.number("offset_x_mm", {-10, 10}, 0), section.number("offset_y_mm", {-10, 10}, 0)};
  shank.lean = {section.number("lean_x_rad", {-0.1, 0.1}, 0), section.number("lean_y_rad", {-0.1, 0.1}, 0)};
  shank.lever = section.number("lever", {0.1, 10}, 1);
  checkEnds(section, shank.from_mm, shank.to_mm);
  section.finish();
  return shank;
}

}  // namespace

void readProbeShank(Section& root, Machine& machine) {
  const bool described = root.has("probe_shank");
  auto section = root.section("probe_shank", false);
  if (described) machine.probe_shank = readDescription(std::move(section), machine);
}

void readWorldShank(Section& spindle, WorldProbeSpindle& described) {
  const bool has = spindle.has("shank");
  auto section = spindle.section("shank", false);
  if (has) described.shank = readEmulated(std::move(section));
}

}  // namespace probebox::board
