#pragma once
#include <string>

namespace probebox::command {

// Which methods `calibrate` runs, and which of them take an option, in words: "centreline and rotary-axis-errors". The
// list of methods is outside of this room; tools/probebox fills this in.
struct MethodHelp {
  std::string all;
  std::string approach, angles, heights, axis, rotary_axis, mounts, tool, head, shank;
  std::string usual_arcs;  // "360 for centreline, 80 for ..."
};

}  // namespace probebox::command
