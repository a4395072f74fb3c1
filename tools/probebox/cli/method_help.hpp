#pragma once
#include <string>

namespace probebox::command {

// Lists of methods for the help: all that `calibrate` runs, and those that take each option, in words such as
// "centreline and rotary-axis-errors". This room does not know the methods; tools/probebox fills this in.
struct MethodHelp {
  std::string all;
  std::string approach, angles, heights, screw, faces, turns, rotary_axis, mounts, tool, probe_tool, head, shank,
      contacts, spindle;
  std::string usual_arcs;  // "360 for centreline, 80 for ..."
};

}  // namespace probebox::command
