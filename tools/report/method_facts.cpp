#include "tools/report/method_facts.hpp"

#include <array>

namespace probebox::report {
namespace {

constexpr std::string_view kDelay = "CN101622513 (system delay)";
constexpr std::string_view kMachine = "CN101976057 (machine tool calibration)";
constexpr std::string_view kTool = "CN103801980 (tool assemblies)";
constexpr std::string_view kScrew = "CN101394969 (ball screws)";
constexpr std::string_view kRotary = "CN112247668 (rotary axes)";

constexpr auto kFacts = std::to_array<MethodFacts>({
    {"a-axis-alignment", "Direction of the tool spindle", "(B4), (B15), (B16)", kMachine},
    {"bore-fit", "Centre and size of a bore", "(B1), (B3a)", kMachine},
    {"boss-fit", "Centre and size of a boss", "(B1), (B3a)", kMachine},
    {"c-axis-alignment", "Direction of the C axis", "(B4), (B14)", kMachine},
    {"c-zero-shift", "Zero of the C axis", "(B25)", kMachine},
    {"centreline", "Centreline of the part's spindle", "(B5)-(B8)", kMachine},
    {"centreline-by-steps", "Centreline with limited access, step by step", "(B8), (B11), (B25)-(B27), (B33)",
     kMachine},
    {"centreline-limited-access", "Centreline with limited access", "(B6)-(B8), (B26), (B27)", kMachine},
    {"corner-fit", "Corner of two or three faces", "(B3c)", kMachine},
    {"delay-contour", "System delay from scans along any feature", "(A1), (A13)-(A17), (A22)", kDelay},
    {"delay-feature", "System delay from touches of any feature", "(A1)-(A9), (A11), (A12)", kDelay},
    {"delay-in-out", "System delay from one drive in and out", "(A1), (A17)-(A19)", kDelay},
    {"delay-joints", "System delay of a machine whose axes are joints", "(A1)-(A9), (A12), (A21)", kDelay},
    {"delay-known-sphere", "System delay from a sphere of known size", "(A1)-(A9), (A12)", kDelay},
    {"delay-multi-speed", "System delay from several speeds", "(A1)-(A8), (A10), (A12)", kDelay},
    {"delay-non-normal", "System delay from touches off the normal", "(A1)-(A9), (A12)", kDelay},
    {"delay-per-axis", "System delay of each axis", "(A1)-(A9), (A11), (A12)", kDelay},
    {"delay-plates", "System delay from parallel faces", "(A1)-(A9)", kDelay},
    {"delay-stepped-scan", "System delay from scans with steps of the radius", "(A1), (A13)-(A17)", kDelay},
    {"head-pivot", "Pivot of a swivelling head", "(B29), (B30)", kMachine},
    {"head-pivot-3d", "Axis of a swivelling head in space", "(B30), (B32)", kMachine},
    {"periodic-check", "Periodic check", "(B23), (B24)", kMachine},
    {"pocket-fit", "Middle and width of a pocket", "(B3b)", kMachine},
    {"rotary-axis-errors", "Errors of a rotary axis", "(E2)-(E12)", kRotary},
    {"screw-calibration", "Calibration of a ball screw's sensor", "(D1)-(D4)", kScrew},
    {"screw-compensation", "Compensation of a ball screw", "(D1), (D3), (D5)", kScrew},
    {"selftest", "First look at a machine and its probe", "(A3)", "none; the gain matrix is that of CN101622513"},
    {"sensor-head-calibration", "Calibration of a sensor head", "(E1)", kRotary},
    {"sphere-fit", "Centre and size of a sphere", "(B1)-(B3)", kMachine},
    {"spindle-offset-2x2", "C axis against spindle, four poses", "(B4), (B10)-(B12)", kMachine},
    {"spindle-offset-four", "C axis against spindle", "(B4), (B9)", kMachine},
    {"swivel-error", "Error of the swivelling head", "(B17)-(B21)", kMachine},
    {"table-pivot", "Pivot of a tilting table", "(B28), (B29)", kMachine},
    {"table-pivot-3d", "Axis of a tilting table in space", "(B31), (B32)", kMachine},
    {"tool-assembly", "Length of an assembled tool", "(C1)-(C4)", kTool},
    {"tool-setter", "Offset of a tool from a setting device", "(B22)-(B22c)", kMachine},
    {"web-fit", "Middle and width of a web", "(B3b)", kMachine},
});

}  // namespace

MethodFacts factsOf(std::string_view method) {
  for (const auto& facts : kFacts) {
    if (facts.method == method) return facts;
  }
  return {method, method, {}, {}};
}

}  // namespace probebox::report
