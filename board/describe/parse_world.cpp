#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "board/describe/machine.hpp"
#include "board/describe/parse.hpp"
#include "board/describe/section.hpp"
#include "board/describe/sim_files.hpp"
#include "board/describe/tool_sections.hpp"
#include "board/describe/world.hpp"

namespace probebox::board {
namespace {

void readLinearAxes(Section section, WorldLinearAxes& axes) {
  readKeys(section, axes);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t along = 0; along < 3; ++along) {
      auto error = section.sectionIfThere(std::string{"E"} + "XYZ"[along] + "XYZ"[axis]);
      if (!error) continue;
      // Straightness has no slope: that is squareness.
      if (along == axis) WorldLinearAxes::scaleKey(axes.scale.at(axis), KeyReader{*error});
      readKeys(*error, axes.waves.at(axis).at(along));
      error->finish();
    }
  }
  section.finish();
}

WorldPartSpindle readPartSpindle(Section section) {
  WorldPartSpindle spindle;
  readKeys(section, spindle);
  for (auto& ball : section.sections("ball", WorldPartSpindle::kMostBalls)) {
    spindle.balls_mm.push_back(ball.vector("at_mm", kPosition_mm));
    ball.finish();
  }
  for (auto& mount : section.sections("further_mount", WorldPartSpindle::kMostFurtherMounts))
    spindle.further_mounts.push_back(read<WorldMount>(std::move(mount)));
  section.finish();
  return spindle;
}

// Reads the axis that a table tilts about, or a head swivels about, nominally along X or Y; then the other keys.
template <class T>
T readSwing(Section section) {
  constexpr std::array<Vector3, 4> kAxes{{{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}}};
  constexpr Range kLean{-0.01, 0.01};
  T swing;
  const std::size_t axis = section.choice("axis", {"X", "-X", "Y", "-Y"});
  const bool about_x = axis < 2;
  swing.direction = kAxes[axis];
  swing.direction[about_x ? 1 : 0] = section.number(about_x ? "lean_y_rad" : "lean_x_rad", kLean, 0.0);
  swing.direction[2] = section.number("lean_z_rad", kLean, 0.0);
  readKeys(section, swing);
  section.finish();
  return swing;
}

void requireNewTool(Section& section, const World& world, std::uint32_t number) {
  const bool used = world.probe_spindle.tool == number ||
                    std::ranges::find(world.further_tools, number, &WorldTool::number) != world.further_tools.end();
  if (used && section.good("number"))
    section.problem("number", "= " + std::to_string(number) +
                                  " is used twice: give each tool a number of its own (the spindle's first tool is " +
                                  std::to_string(world.probe_spindle.tool) + ", see [probe_spindle] tool)");
}

// Reads a tool by one of the lists of WorldTool.
void readTool(Section& section, World& world, const auto& keys) {
  WorldTool tool;
  keys(tool, KeyReader{section});
  requireNewTool(section, world, tool.number);
  section.finish();
  world.further_tools.push_back(tool);
}

WorldShank readShank(Section section) {
  WorldShank shank;
  readKeys(section, shank);
  checkEnds(section, shank.from_mm, shank.to_mm);
  section.finish();
  return shank;
}

void readProbeSpindle(Section section, World& world) {
  auto& spindle = world.probe_spindle;
  readKeys(section, spindle);
  if (auto shank = section.sectionIfThere("shank")) spindle.shank = readShank(std::move(*shank));
  for (auto& further : section.sections("further_tool", kMostTools))
    readTool(further, world, [](WorldTool& tool, const KeyReader& key) {
      WorldTool::numberKey(tool, key);
      WorldTool::stylusKeys(tool.offset_mm, tool.length_mm, key);
    });
  section.finish();
}

// Returns whether the directions of the three sensors span space.
bool spansSpace(const Matrix3& m) {
  constexpr double kLeastVolume = 1e-3;
  const double volume = m[0][0] * (m[1][1] * m[2][2] - m[1][2] * m[2][1]) +
                        m[0][1] * (m[1][2] * m[2][0] - m[1][0] * m[2][2]) +
                        m[0][2] * (m[1][0] * m[2][1] - m[1][1] * m[2][0]);
  return std::abs(volume) >= kLeastVolume;
}

void readSensorHead(Section section, World& world) {
  readTool(section, world, [&section](WorldTool& tool, const KeyReader& key) {
    WorldTool::sensorHeadKeys(tool, key);
    if (section.good("sensors") && !spansSpace(tool.head->sensors))
      section.problem("sensors", "looks along directions that lie nearly in one plane: turn one of the sensors");
  });
}

void readScrews(Section section, World& world) {
  for (std::size_t axis = 0; axis < world.screws.size(); ++axis)
    world.screws.at(axis) = readIfThere<WorldScrew>(section, std::string{"XYZ"[axis]});
  section.finish();
}

WorldOutsideControl readOutsideControl(Section section, const World& world) {
  WorldOutsideControl control;
  readKeys(section, control);
  const std::size_t usual = world.swivel_head || !world.tilting_table ? 0 : 1;
  control.b_swivels_head = section.choice("b_turns", {"head", "table"}, usual) == 0;
  const bool is_there = control.b_swivels_head ? world.swivel_head.has_value() : world.tilting_table.has_value();
  if (section.good("b_turns") && !is_there) {
    section.problem("b_turns", control.b_swivels_head
                                   ? "= \"head\", but there is no [swivel_head]: describe it, or remove b_turns"
                                   : "= \"table\", but there is no [tilting_table]: describe it, or remove b_turns");
  }
  section.finish();
  return control;
}

World readWorld(Section& root) {
  constexpr std::size_t kMostFaults = 32;
  World world;
  readKeys(root, world);
  world.delays = read<WorldDelays>(root.section("delays"));
  world.clock = read<WorldClock>(root.section("master_clock"));
  world.encoders = read<WorldEncoders>(root.section("encoders"));
  world.axes = read<WorldAxes>(root.section("axes"));
  if (auto section = root.sectionIfThere("linear_axes")) readLinearAxes(std::move(*section), world.linear_axes);
  world.probe = read<WorldProbe>(root.section("probe"));
  world.touch_trigger = readIfThere<WorldTouchTrigger>(root, "touch_trigger");
  world.sphere = read<WorldSphere>(root.section("datum_sphere"));
  world.plates = readByAxis<WorldPlates>(root.section("gauge_plates", false), "gap_mm");
  world.cylinder = readIfThere<WorldCylinder>(root, "gauge_cylinder");
  world.cube = readIfThere<WorldCube>(root, "gauge_cube");
  if (auto section = root.sectionIfThere("part_spindle")) world.part_spindle = readPartSpindle(std::move(*section));
  if (auto section = root.sectionIfThere("second_spindle")) world.second_spindle = readPartSpindle(std::move(*section));
  if (auto section = root.sectionIfThere("tilting_table"))
    world.tilting_table = readSwing<WorldTiltingTable>(std::move(*section));
  if (auto section = root.sectionIfThere("swivel_head"))
    world.swivel_head = readSwing<WorldSwivelHead>(std::move(*section));
  if (auto section = root.sectionIfThere("probe_spindle")) readProbeSpindle(std::move(*section), world);
  if (auto section = root.sectionIfThere("rotary_axes")) world.rotary = read<WorldRotary>(std::move(*section));
  readScrews(root.section("screw", false), world);
  world.tool_setter = readIfThere<WorldToolSetter>(root, "tool_setter");
  for (auto& section : root.sections("tool", kMostTools))
    readTool(section, world, [](WorldTool& tool, const KeyReader& key) { WorldTool::cutterKeys(tool, key); });
  if (auto section = root.sectionIfThere("sensor_head")) readSensorHead(std::move(*section), world);
  world.cycle = read<WorldCycle>(root.section("cycle"));
  if (auto section = root.sectionIfThere("outside_control"))
    world.outside_control = readOutsideControl(std::move(*section), world);
  for (auto& fault : root.sections("fault", kMostFaults)) world.faults.push_back(read<WorldFault>(std::move(fault)));
  for (auto& vibration : root.sections("vibration", WorldVibration::kMost))
    world.vibrations.push_back(read<WorldVibration>(std::move(vibration)));
  return world;
}

}  // namespace

Outcome<World> parseWorld(std::string_view text, std::string_view file_name) {
  return readDocument<World>(text, file_name, readWorld,
                             [](toml::table& world) { completeLikeSim(world, "world.toml"); });
}

}  // namespace probebox::board
