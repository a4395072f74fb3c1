#pragma once
#include <Eigen/Core>
#include <gtest/gtest.h>
#include <string>
#include <vector>

#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/plan/plan.hpp"
#include "interpreter.hpp"
#include "tools/gcode/program.hpp"
#include "tools/gcode/unroll.hpp"

// Programs of all methods, for the tests of this room.
namespace probebox::gcode {

inline constexpr double kRounding_mm = 0.0011;  // of a place, and of the way to the next one from there
inline constexpr double kSafe_mm = 90;

// on_lathe: of X and Z.
inline Setting setting(bool on_lathe = false) {
  Setting setting;
  setting.at_mm = {1, -2, 3};
  if (on_lathe) {
    setting.has_y = setting.orients = false;
    setting.at_mm.y() = 0;
  }
  setting.balls_mm = {{60, 0, 20}, {-50, 20, 35}, {-10, -60, 30}, {20, 55, 25}};
  setting.c_axis_mm = {0.5, 0.25, 0};
  setting.table_axis_mm = Eigen::Vector3d{0, 0, -50};
  setting.ball_diameter_mm = 25;
  setting.gap_mm = 26;
  setting.bore_mm = 30;
  setting.cube_mm = {20, 24, 18};
  setting.setter_width_mm = 16;
  setting.stylus_diameter_mm = 6;
  setting.tool_diameter_mm = 10;
  setting.safe_z_mm = kSafe_mm;
  setting.probe_tool = 7;
  return setting;
}

struct Case {
  const procedure::LiveMethod* method{};
  ProcedureOptions options{};
};

inline std::vector<Case> cases() {
  ProcedureOptions three;
  three.angles = 3;
  ProcedureOptions tool;
  tool.tool = 4;
  ProcedureOptions tilted;
  tilted.b_count = 3;
  tilted.b_angles_rad = {-0.3, 0, 0.3};
  tilted.b_axis = {1, 0, 0};
  ProcedureOptions sweep;
  sweep.axis = 2;
  sweep.travel_mm = 40;
  sweep.speed_count = 1;
  sweep.speeds_mm_s[0] = 5;
  ProcedureOptions rest;
  rest.axis = 1;
  ProcedureOptions scan;
  scan.reach_mm = 15.5;
  return {{&procedure::kDelayMultiSpeed, {}},  {&procedure::kDelayPlates, {}},
          {&procedure::kDelayInOut, {}},       {&procedure::kDelayNonNormal, {}},
          {&procedure::kCentreline, three},    {&procedure::kToolSetter, tool},
          {&procedure::kTablePivot, tilted},   {&procedure::kScrewCalibration, sweep},
          {&procedure::kScrewReference, rest}, {&procedure::kDelaySteppedScan, scan},
          {&procedure::kDelayContour, scan},   {&procedure::kMachineCheck, {}},
          {&procedure::kDelayCylinder, {}},    {&procedure::kDelayCube, {}},
          {&procedure::kJoint, three}};
}

inline procedure::Plan planOf(const Case& c) {
  procedure::Plan plan;
  EXPECT_FALSE(validate(*c.method, c.options, 2)) << validate(*c.method, c.options, 2)->what;
  fill(plan, *c.method, c.options);
  EXPECT_GT(plan.step_count, 0U);
  return plan;
}

inline std::vector<std::string_view> dialectsOf(bool lathes) {
  std::vector<std::string_view> names;
  for (const auto name : dialectNames()) {
    if (dialectNamed(name)->isLathe() == lathes) names.push_back(name);
  }
  return names;
}

inline Machine machineOf(const Dialect& dialect) {
  return !dialect.isLathe() ? Machine::mill : &dialect == &fanucLathe() ? Machine::system_a : Machine::siemens_lathe;
}

inline std::string written(const Case& c, const Dialect& dialect, Marks marks, const Setting& with) {
  const auto blocks = unroll(planOf(c), with);
  EXPECT_TRUE(blocks) << blocks.error().what;
  if (!blocks) return {};
  return program(*blocks, with, {std::string{c.method->name()}, "probebox calibrate", "zero"}, dialect, marks);
}

inline std::string written(const Case& c, const Dialect& dialect, Marks marks = Marks::lines) {
  return written(c, dialect, marks, setting(dialect.isLathe()));
}

// Head and tools that cases() do without.
inline Case headCase(const procedure::LiveMethod& method, std::vector<std::uint32_t> tools) {
  ProcedureOptions options;
  options.b_count = 3;
  options.b_angles_rad = {0, 0.4, 0.8};
  options.b_axis = {0, 1, 0};
  options.tool_count = static_cast<std::uint8_t>(tools.size());
  std::ranges::copy(tools, options.tools.begin());
  return {&method, options};
}

inline Case headCalibration() {
  ProcedureOptions options;
  options.head_tool = 9;
  options.head_range_mm = 5;
  return {&procedure::kSensorHeadCalibration, options};
}

// Every method that has a program, once at least.
inline std::vector<Case> allCases() {
  auto all = cases();
  ProcedureOptions tool, tilted = cases()[6].options;
  tool.tool = 4;
  tilted.axis = procedure::kAxisB;
  for (const auto* method :
       {&procedure::kDelayKnownSphere, &procedure::kDelayPerAxis, &procedure::kCentrelineLimitedAccess,
        &procedure::kSpindleOffset2x2, &procedure::kSpindleOffsetFour, &procedure::kCAxisAlignment,
        &procedure::kPeriodicCheck, &procedure::kAAxisAlignment, &procedure::kPreTravel, &procedure::kCentrelineX})
    all.push_back({method, {}});
  all.push_back({&procedure::kToolAssembly, tool});
  all.push_back({&procedure::kRotaryAxisErrors, {}});
  all.push_back({&procedure::kRotaryAxisErrors, tilted});
  all.push_back(headCase(procedure::kHeadPivot, {}));
  all.push_back(headCase(procedure::kSwivelError, {3, 4}));
  all.push_back(headCalibration());
  return all;
}

// Those that a machine without Y can make, as the box makes them for it.
inline std::vector<Case> casesOfLathe() {
  auto all = allCases();
  std::erase_if(all, [](const Case& c) { return !c.method->why_no_y.empty(); });
  for (auto& c : all) {
    const auto usual = c.method->usual.faces;
    c.options.faces = (usual != 0 ? usual : procedure::kFacesAcrossY) & procedure::kFacesAcrossY;
    if (c.method->takes_axis) c.options.axis = 1;
  }
  return all;
}

}  // namespace probebox::gcode
