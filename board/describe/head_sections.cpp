#include "board/describe/head_sections.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "board/describe/tool_sections.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::board {
namespace {

constexpr Range kSensorRange_mm{0.01, 50};

SensorHeadDescription readDescribedSensorHead(Section section, const Machine& machine) {
  SensorHeadDescription head;
  head.tool = static_cast<std::uint32_t>(section.integer("tool", kToolNumbers));
  head.range_mm = section.number("range_mm", kSensorRange_mm);
  head.centre_offset_mm = section.vector("centre_offset_mm", {-5000, 5000});
  head.sd_centre_offset_mm = section.numberIfThere("sd_centre_offset_mm", {1e-6, 10});
  const auto carries = [&](const ToolDescription& tool) { return tool.number == head.tool; };
  if (section.good("tool") && std::ranges::any_of(machine.probe_tools, carries))
    section.problem("tool", "= " + std::to_string(head.tool) +
                                " carries the probe ([probe_tools]): write the number of the sensor head");
  section.finish();
  return head;
}

// Whether the directions of the three sensors span space.
bool spansSpace(const std::array<std::array<double, 3>, 3>& m) {
  constexpr double kLeastVolume = 1e-3;
  const double volume = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) +
                        m[0][1] * (m[1][2] * m[2][0] - m[1][0] * m[2][2]) +
                        m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  return std::abs(volume) >= kLeastVolume;
}

WorldTool readEmulatedSensorHead(Section section, const World& world) {
  const auto number = static_cast<std::uint32_t>(section.integer("number", kToolNumbers));
  const WorldTool tool{
      .number = number,
      .offset_mm = {section.number("offset_x_mm", {-10, 10}, 0), section.number("offset_y_mm", {-10, 10}, 0)},
      .length_mm = section.number("length_mm", {0, kMostToolLength_mm}),
      .head = WorldSensorHead{.sensors = section.matrix("sensors", {-1000, 1000}),
                              .range_mm = section.number("range_mm", kSensorRange_mm),
                              .noise_um = section.number("noise_um", {0, 100})}};
  requireNewTool(section, world, number);
  if (section.good("sensors") && !spansSpace(tool.head->sensors))
    section.problem("sensors", "looks along directions that lie nearly in one plane: turn one of the sensors");
  section.finish();
  return tool;
}

}  // namespace

void readSensorHead(Section& root, Machine& machine) {
  if (auto section = root.sectionIfThere("sensor_head"))
    machine.sensor_head = readDescribedSensorHead(std::move(*section), machine);
}

void readWorldHead(Section& root, World& world) {
  if (auto section = root.sectionIfThere("sensor_head"))
    world.further_tools.push_back(readEmulatedSensorHead(std::move(*section), world));
}

}  // namespace probebox::board
