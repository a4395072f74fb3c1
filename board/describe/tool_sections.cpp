#include "board/describe/tool_sections.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "board/describe/places.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::board {
namespace {

template <class Description>
bool isThere(const std::vector<Description>& all, std::uint32_t number) {
  return std::ranges::find(all, number, &Description::number) != all.end();
}

// Notes a number that an earlier [[tool]] or [[holder]] of the list has already.
template <class Description>
void requireNew(Section& section, const std::vector<Description>& before, std::uint32_t number) {
  if (section.good("number") && isThere(before, number))
    section.problem("number", "= " + std::to_string(number) + " is used twice: give each one a number of its own");
}

void readHolders(std::vector<Section> sections, Machine& machine) {
  for (auto& section : sections) {
    HolderDescription holder;
    readKeys(section, holder);
    requireNew(section, machine.holders, holder.number);
    section.finish();
    machine.holders.push_back(holder);
  }
}

// One face of each axis of the machine, or both; the device stands on its -Z face.
std::uint8_t readFaces(Section& section, bool has_y) {
  constexpr std::array<std::string_view, 5> kFaces{"+X", "-X", "+Y", "-Y", "+Z"};
  unsigned faces = 0;
  for (const auto& [text, line] : section.texts("faces", kFaces.size())) {
    const auto* face = std::ranges::find(kFaces, text);
    if (face == kFaces.end()) {
      section.problemAt(line, "faces", "names \"" + text + "\": choose from +X, -X, +Y, -Y and +Z");
    } else {
      faces |= 1U << static_cast<unsigned>(face - kFaces.begin());
    }
  }
  const bool every_axis = (faces & 3U) != 0 && ((faces & 12U) != 0) == has_y && (faces & 16U) != 0;
  if (faces != 0 && !every_axis)
    section.problem("faces", has_y
                                 ? "leaves an axis out: name one face or both of X and of Y, and +Z"
                                 : "leaves an axis out, or names Y, which this machine does not have: name one face or "
                                   "both of X, and +Z");
  return static_cast<std::uint8_t>(faces);
}

// Angles of the head from 0 on, at each of which the device is measured.
std::vector<double> readSwivels(Section& section, const Machine& machine) {
  if (!section.has("swivels_deg")) return {};
  auto swivels = section.numbers("swivels_deg", {0, 180}, {2, kMostTilts});
  if (!section.good("swivels_deg")) return {};
  if (swivels.front() != 0 || std::ranges::adjacent_find(swivels, std::ranges::greater_equal{}) != swivels.end()) {
    section.problem("swivels_deg", "has to rise from 0: write them in that order, each once");
  } else if (!machine.swivel_head) {
    section.problem("swivels_deg", "needs a head that swivels: describe [swivel_head], or remove this key");
  }
  return swivels;
}

// Both lengths count from the gauge line, and a tool that ends inside of its holder touches nothing.
void requireBeyondHolder(Section& section, const ToolDescription& tool, const Machine& machine) {
  const auto holder = std::ranges::find_if(
      machine.holders, [&](const HolderDescription& candidate) { return candidate.number == tool.holder; });
  if (holder != machine.holders.end() && tool.length_mm <= holder->length_mm)
    section.problem("length_mm", "= " + plain(tool.length_mm) + " is not beyond the end face of its [[holder]], " +
                                     plain(holder->length_mm) +
                                     " mm from the gauge line: correct one of them, or the number of the holder");
}

void readToolLengths(std::vector<Section> sections, Machine& machine) {
  for (auto& section : sections) {
    ToolDescription tool;
    readKeys(section, tool);
    tool.faces = readFaces(section, machine.has_y);
    if (section.has("holder")) tool.holder = static_cast<std::uint32_t>(section.integer("holder", kToolNumbers));
    requireNew(section, machine.tools, tool.number);
    if (section.good("holder") && !isThere(machine.holders, *tool.holder))
      section.problem("holder", "= " + std::to_string(*tool.holder) + " is no [[holder]]: add it, or remove this key");
    if (section.good("length_mm")) requireBeyondHolder(section, tool, machine);
    section.finish();
    machine.tools.push_back(tool);
  }
}

ToolSetterDescription readDescribedSetter(Section section, const Machine& machine) {
  ToolSetterDescription setter;
  readKeys(section, setter);
  if (section.good("accepted_mm") && section.good("probe_offset_mm")) {
    auto probe_at_mm = *setter.accepted_mm;  // with the probe's tip in the middle of the device
    for (std::size_t i = 0; i < probe_at_mm.size(); ++i) probe_at_mm.at(i) -= setter.probe_offset_mm.at(i);
    requireReachable(section, "accepted_mm", probe_at_mm, machine);
  }
  if (section.has("sd_accepted_mm") && !setter.accepted_mm)
    section.problem("sd_accepted_mm",
                    "says how exactly 'accepted_mm' is known, which is missing: add it, or remove this");
  setter.swivels_deg = readSwivels(section, machine);
  const bool has_limit = section.has("limit_mm");
  if (setter.accepted_mm.has_value() != has_limit)
    section.problem(has_limit ? "limit_mm" : "accepted_mm",
                    "needs its partner: 'accepted_mm' and 'limit_mm' say together how far the device may have moved; "
                    "give both or none");
  section.finish();
  return setter;
}

SensorHeadDescription readDescribedSensorHead(Section section, const Machine& machine) {
  SensorHeadDescription head;
  readKeys(section, head);
  const auto carries = [&](const ToolDescription& tool) { return tool.number == head.tool; };
  if (section.good("tool") && std::ranges::any_of(machine.probe_tools, carries))
    section.problem("tool", "= " + std::to_string(head.tool) +
                                " carries the probe ([probe_tools]): write the number of the sensor head");
  section.finish();
  return head;
}

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
  readKeys(section, shank);
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

void readTools(Section& root, Machine& machine) {
  readHolders(root.sections("holder", kMostTools), machine);
  readToolLengths(root.sections("tool", kMostTools), machine);
}

void readToolSetter(Section& root, Machine& machine) {
  if (auto section = root.sectionIfThere("tool_setter"))
    machine.tool_setter = readDescribedSetter(std::move(*section), machine);
}

void readSensorHead(Section& root, Machine& machine) {
  if (auto section = root.sectionIfThere("sensor_head"))
    machine.sensor_head = readDescribedSensorHead(std::move(*section), machine);
}

void readProbeShank(Section& root, Machine& machine) {
  if (auto section = root.sectionIfThere("probe_shank"))
    machine.probe_shank = readDescribedShank(std::move(*section), machine);
}

void checkEnds(Section& section, double from_mm, double to_mm) {
  if (section.good("from_mm") && section.good("to_mm") && from_mm >= to_mm)
    section.problem("to_mm", "is not above 'from_mm': exchange them");
}

}  // namespace probebox::board
