#include "board/describe/tool_sections.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>
#include <string>

namespace probebox::board {
namespace {

constexpr Range kAnywhere{-1e6, 1e6};
constexpr Range kHalfWidth_mm{0.5, 500};

template <class Description>
bool isThere(const std::vector<Description>& all, std::uint32_t number) {
  return std::ranges::find(all, number, &Description::number) != all.end();
}

// Problems of one more tool or holder of a list.
template <class Description>
void check(Section& section, const std::string& what, const std::vector<Description>& before, std::uint32_t number) {
  if (isThere(before, number))
    section.problem(*section.node("number"), what + " " + std::to_string(number) + " is there twice: give it once");
  if (before.size() == kMostTools)
    section.problem(*section.node("number"), "there are more than " + std::to_string(kMostTools) + " " + what +
                                                 "s: let the controller tell their lengths");
}

void readHolders(std::vector<Section> sections, Machine& machine) {
  for (auto& section : sections) {
    const HolderDescription holder{.number = static_cast<std::uint32_t>(section.integer("number", kToolNumbers)),
                                   .length_mm = section.number("length_mm", {0.1, kMostToolLength_mm}),
                                   .sd_mm = section.number("sd_mm", {0, 1}, 0)};
    section.finish();
    check(section, "holder", machine.holders, holder.number);
    machine.holders.push_back(holder);
  }
}

void readToolLengths(std::vector<Section> sections, Machine& machine) {
  for (auto& section : sections) {
    ToolDescription tool{.number = static_cast<std::uint32_t>(section.integer("number", kToolNumbers)),
                         .length_mm = section.number("length_mm", {0.1, kMostToolLength_mm}),
                         .sd_mm = section.number("sd_mm", {0, 1}, 0),
                         .holder = std::nullopt};
    if (section.has("holder")) tool.holder = static_cast<std::uint32_t>(section.integer("holder", kToolNumbers));
    section.finish();
    check(section, "tool", machine.tools, tool.number);
    if (tool.holder && !isThere(machine.holders, *tool.holder))
      section.problem(*section.node("holder"), "there is no [[holder]] with number " + std::to_string(*tool.holder) +
                                                   ": add it, or leave the key away");
    machine.tools.push_back(tool);
  }
}

ToolSetterDescription readDescription(Section section) {
  ToolSetterDescription setter;
  setter.trigger = section.text("trigger");
  setter.half_width_mm = section.vector("half_width_mm", kHalfWidth_mm);
  setter.probe_offset_mm = section.vector("probe_offset_mm", {-5000, 5000});
  if (section.has("sd_probe_offset_mm")) setter.sd_probe_offset_mm = section.number("sd_probe_offset_mm", {kTiny, 1});
  const bool accepted = section.has("accepted_mm"), limited = section.has("limit_mm");
  if (accepted) setter.accepted_mm = section.vector("accepted_mm", kAnywhere);
  if (section.has("sd_accepted_mm")) {
    setter.sd_accepted_mm = section.number("sd_accepted_mm", {kTiny, 1});
    if (!accepted) {
      section.problem(*section.node("sd_accepted_mm"),
                      "'sd_accepted_mm' is of 'accepted_mm', which is not there: give both, or remove it");
    }
  }
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

}  // namespace

void readTools(Section& root, Machine& machine) {
  readHolders(root.sections("holder"), machine);
  readToolLengths(root.sections("tool"), machine);
}

void readToolSetter(Section& root, Machine& machine) {
  const bool described = root.has("tool_setter");
  auto section = root.section("tool_setter", false);
  if (described) machine.tool_setter = readDescription(std::move(section));
}

bool hasTool(const World& world, std::uint32_t number) {
  const auto is = [number](const auto& tool) { return tool.number == number; };
  const auto& spindle = world.probe_spindle;
  if (spindle && (spindle->tool == number || std::ranges::any_of(spindle->further_tools, is))) return true;
  return std::ranges::any_of(world.cutters, is);
}

void readWorldTools(Section& root, World& world) {
  const bool described = root.has("tool_setter");
  auto setter = root.section("tool_setter", false);
  if (described) world.tool_setter = readEmulated(std::move(setter));
  for (auto& section : root.sections("tool")) {
    const WorldCutter tool{
        .number = static_cast<std::uint32_t>(section.integer("number", kToolNumbers)),
        .offset_mm = {section.number("offset_x_mm", {-10, 10}, 0), section.number("offset_y_mm", {-10, 10}, 0)},
        .length_mm = section.number("length_mm", {0.1, kMostToolLength_mm}),
        .radius_mm = section.number("radius_mm", {0.05, 100})};
    section.finish();
    if (hasTool(world, tool.number))
      section.problem(*section.node("number"), "tool " + std::to_string(tool.number) + " is there twice: give it once");
    world.cutters.push_back(tool);
  }
}

}  // namespace probebox::board
