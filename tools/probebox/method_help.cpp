#include "tools/probebox/method_help.hpp"

#include <cmath>
#include <functional>
#include <map>
#include <vector>

#include "firmware/procedure/methods/methods.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::command {
namespace {

using procedure::LiveMethod;

// "a, b and c".
std::string joined(const std::vector<std::string_view>& names) {
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i > 0) text += i + 1 == names.size() ? " and " : ", ";
    text += names[i];
  }
  return text;
}

std::string methodsWith(bool (*has)(const LiveMethod&)) {
  std::vector<std::string_view> names;
  for (const LiveMethod* method : procedure::liveMethods()) {
    if (method->calibrates && has(*method)) names.push_back(method->name());
  }
  return joined(names);
}

std::string usualArcs() {
  std::map<int, std::vector<std::string_view>, std::greater<>> methods_of_arc;
  for (const LiveMethod* method : procedure::liveMethods()) {
    const auto arc_deg = static_cast<int>(std::lround(degrees(method->usual.arc_rad)));
    if (arc_deg != 0) methods_of_arc[arc_deg].push_back(method->name());
  }
  std::string text;
  for (const auto& [arc_deg, names] : methods_of_arc)
    text += (text.empty() ? "" : ", ") + std::to_string(arc_deg) + " for " + joined(names);
  return text;
}

}  // namespace

MethodHelp methodHelp() {
  return {
      .all = methodsWith([](const LiveMethod&) { return true; }),
      .approach = methodsWith([](const LiveMethod& method) { return method.usual.approach_rad != 0; }),
      .angles = methodsWith([](const LiveMethod& method) { return method.usual.angles != 0; }),
      .heights = methodsWith([](const LiveMethod& method) { return method.usual.balls != 0; }),
      .screw = methodsWith([](const LiveMethod& method) { return method.of_screw; }),
      .faces = methodsWith([](const LiveMethod& method) { return method.takes_axis && !method.of_screw; }),
      .turns = methodsWith([](const LiveMethod& method) { return method.takes_turns; }),
      .rotary_axis = methodsWith([](const LiveMethod& method) { return method.measuresBOrC(); }),
      .mounts = methodsWith([](const LiveMethod& method) { return method.usual.mounts != 0; }),
      .tool = methodsWith([](const LiveMethod& method) { return method.takes_tool; }),
      .probe_tool = methodsWith([](const LiveMethod& method) { return method.takes_probe_tool; }),
      .head = methodsWith([](const LiveMethod& method) { return !method.steps_by_head.empty(); }),
      .shank = methodsWith([](const LiveMethod& method) { return method.takesShank(); }),
      .contacts = methodsWith([](const LiveMethod& method) { return method.takes_contacts; }),
      .spindle = methodsWith([](const LiveMethod& method) { return method.takesSpindle(); }),
      .usual_arcs = usualArcs(),
  };
}

}  // namespace probebox::command
