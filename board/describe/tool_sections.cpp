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

constexpr Range kHalfWidth_mm{0.5, 500};

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
    const HolderDescription holder{.number = static_cast<std::uint32_t>(section.integer("number", kToolNumbers)),
                                   .length_mm = section.number("length_mm", {0.1, kMostToolLength_mm}),
                                   .sd_mm = section.number("sd_mm", {0, 1}, 0)};
    requireNew(section, machine.holders, holder.number);
    section.finish();
    machine.holders.push_back(holder);
  }
}

// One face an axis, or both; the device stands on its -Z face.
std::uint8_t readFaces(Section& section) {
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
  const bool every_axis = (faces & 3U) != 0 && (faces & 12U) != 0 && (faces & 16U) != 0;
  if (faces != 0 && !every_axis)
    section.problem("faces", "leaves an axis out: name one face or both of X and of Y, and +Z");
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
    ToolDescription tool{.number = static_cast<std::uint32_t>(section.integer("number", kToolNumbers)),
                         .length_mm = section.number("length_mm", {0.1, kMostToolLength_mm}),
                         .sd_mm = section.number("sd_mm", {0, 1}, 0),
                         .holder = std::nullopt,
                         .faces = readFaces(section)};
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
  setter.trigger = section.text("trigger");
  setter.half_width_mm = section.vector("half_width_mm", kHalfWidth_mm);
  setter.sd_half_width_mm = section.numberIfThere("sd_half_width_mm", {1e-6, 1});
  setter.probe_offset_mm = section.vector("probe_offset_mm", {-5000, 5000});
  setter.sd_probe_offset_mm = section.numberIfThere("sd_probe_offset_mm", {1e-6, 1});
  setter.accepted_mm = section.vectorIfThere("accepted_mm", kPosition_mm);
  if (section.good("accepted_mm") && section.good("probe_offset_mm")) {
    auto probe_at_mm = *setter.accepted_mm;  // with the probe's tip in the middle of the device
    for (std::size_t i = 0; i < probe_at_mm.size(); ++i) probe_at_mm.at(i) -= setter.probe_offset_mm.at(i);
    requireReachable(section, "accepted_mm", probe_at_mm, machine);
  }
  const auto sd_accepted_mm = section.numberIfThere("sd_accepted_mm", {1e-6, 1});
  setter.sd_accepted_mm = sd_accepted_mm.value_or(0);
  if (sd_accepted_mm && !setter.accepted_mm)
    section.problem("sd_accepted_mm",
                    "says how exactly 'accepted_mm' is known, which is missing: add it, or remove this");
  setter.swivels_deg = readSwivels(section, machine);
  const auto limit_mm = section.numberIfThere("limit_mm", {1e-6, 100});
  setter.limit_mm = limit_mm.value_or(0);
  if (setter.accepted_mm.has_value() != limit_mm.has_value())
    section.problem(limit_mm ? "limit_mm" : "accepted_mm",
                    "needs its partner: 'accepted_mm' and 'limit_mm' say together how far the device may have moved; "
                    "give both or none");
  section.finish();
  return setter;
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

}  // namespace probebox::board
