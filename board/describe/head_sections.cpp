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

}  // namespace

void readSensorHead(Section& root, Machine& machine) {
  if (auto section = root.sectionIfThere("sensor_head"))
    machine.sensor_head = readDescribedSensorHead(std::move(*section), machine);
}

}  // namespace probebox::board
