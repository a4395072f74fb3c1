#include "board/describe/head_sections.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "board/describe/tool_sections.hpp"

namespace probebox::board {
namespace {

constexpr Range kSensorRange_mm{0.01, 50};

SensorHeadDescription readDescription(Section section, const Machine& machine) {
  SensorHeadDescription head;
  head.tool = static_cast<std::uint32_t>(section.integer("tool", kToolNumbers));
  head.range_mm = section.number("range_mm", kSensorRange_mm);
  head.centre_offset_mm = section.vector("centre_offset_mm", {-5000, 5000});
  if (section.has("sd_centre_offset_mm")) head.sd_centre_offset_mm = section.number("sd_centre_offset_mm", {kTiny, 10});
  const auto carries = [&](const ToolDescription& tool) { return tool.number == head.tool; };
  if (section.has("tool") && std::ranges::any_of(machine.probe_tools, carries)) {
    section.problem(*section.node("tool"), "tool " + std::to_string(head.tool) +
                                               " carries the probe ([probe_tools]): the head is another tool");
  }
  section.finish();
  return head;
}

// Three sensors that look from sides of their own.
bool spansSpace(const std::array<std::array<double, 3>, 3>& m) {
  constexpr double kLeastVolume = 1e-3;
  const double volume = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) +
                        m[0][1] * (m[1][2] * m[2][0] - m[1][0] * m[2][2]) +
                        m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  return std::abs(volume) >= kLeastVolume;
}

WorldSensorHead readEmulated(Section section, const World& world) {
  WorldSensorHead head;
  head.number = static_cast<std::uint32_t>(section.integer("number", kToolNumbers));
  head.offset_mm = {section.number("offset_x_mm", {-10, 10}, 0), section.number("offset_y_mm", {-10, 10}, 0)};
  head.length_mm = section.number("length_mm", {0, kMostToolLength_mm});
  const bool has_sensors = section.has("sensors");
  head.sensors = section.matrix("sensors");
  head.range_mm = section.number("range_mm", kSensorRange_mm);
  head.noise_um = section.number("noise_um", {0, 100});
  if (section.has("number") && hasTool(world, head.number))
    section.problem(*section.node("number"), "tool " + std::to_string(head.number) + " is there twice: give it once");
  if (has_sensors && !spansSpace(head.sensors))
    section.problem(*section.node("sensors"), "the sensors look from nearly the same side: turn one of them");
  section.finish();
  return head;
}

}  // namespace

void readSensorHead(Section& root, Machine& machine) {
  const bool described = root.has("sensor_head");
  auto section = root.section("sensor_head", false);
  if (described) machine.sensor_head = readDescription(std::move(section), machine);
}

void readWorldHead(Section& root, World& world) {
  const bool described = root.has("sensor_head");
  auto section = root.section("sensor_head", false);
  if (described) world.sensor_head = readEmulated(std::move(section), world);
}

}  // namespace probebox::board
