#include "board/describe/tool_sections.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

namespace probebox::board {
namespace {

constexpr Range kAnywhere{-1e6, 1e6};
constexpr Range kHalfWidth_mm{0.5, 500};
constexpr std::size_t kMostWorldTools = 8;

ToolSetterDescription readDescription(Section section) {
  ToolSetterDescription setter;
  setter.trigger = section.text("trigger");
  setter.half_width_mm = section.vector("half_width_mm", kHalfWidth_mm);
  setter.probe_offset_mm = section.vector("probe_offset_mm", {-5000, 5000});
  if (section.has("sd_probe_offset_mm")) setter.sd_probe_offset_mm = section.number("sd_probe_offset_mm", {kTiny, 1});
  const bool accepted = section.has("accepted_mm"), limited = section.has("limit_mm");
  if (accepted) setter.accepted_mm = section.vector("accepted_mm", kAnywhere);
  if (limited) setter.limit_mm = section.number("limit_mm", {1e-6, 100});
  if (accepted != limited) {
    section.problem(*section.node(accepted ? "accepted_mm" : "limit_mm"),
                    "'accepted_mm' and 'limit_mm' tell together how far the device may have moved: give both or none");
  }
  section.finish();
  return setter;
}

WorldToolSetter readEmulated(Section section) {
  WorldToolSetter setter;
  setter.centre_mm = section.vector("centre_mm", kAnywhere);
  setter.half_width_mm = section.vector("half_width_mm", kHalfWidth_mm);
  setter.late_s = section.number("late_s", {0, 0.02});
  setter.repeatability_um = section.number("repeatability_um", {0, 100}, 0);
  section.finish();
  return setter;
}

bool there(const World& world, std::uint32_t number) {
  const auto is = [number](const auto& tool) { return tool.number == number; };
  const auto& spindle = world.probe_spindle;
  if (spindle && (spindle->tool == number || std::ranges::any_of(spindle->further_tools, is))) return true;
  return std::ranges::any_of(world.cutters, is);
}

}  // namespace

void readToolSetter(Section& root, Machine& machine) {
  const bool described = root.has("tool_setter");
  auto section = root.section("tool_setter", false);
  if (described) machine.tool_setter = readDescription(std::move(section));
}

void readWorldTools(Section& root, World& world) {
  const bool described = root.has("tool_setter");
  auto setter = root.section("tool_setter", false);
  if (described) world.tool_setter = readEmulated(std::move(setter));
  for (auto& section : root.sections("tool")) {
    const WorldCutter tool{
        .number = static_cast<std::uint32_t>(section.integer("number", {1, 65'535})),
        .offset_mm = {section.number("offset_x_mm", {-10, 10}, 0), section.number("offset_y_mm", {-10, 10}, 0)},
        .length_mm = section.number("length_mm", {0.1, kMostToolLength_mm}),
        .radius_mm = section.number("radius_mm", {0.05, 100})};
    section.finish();
    if (there(world, tool.number))
      section.problem(*section.node("number"), "tool " + std::to_string(tool.number) + " is there twice: give it once");
    if (world.cutters.size() == kMostWorldTools)
      section.problem(*section.node("number"), "more than 8 tools: remove some");
    world.cutters.push_back(tool);
  }
}

}  // namespace probebox::board
