#include "tools/report/measurand.hpp"

#include <algorithm>
#include <array>

namespace probebox::report {
namespace {

struct Measurand {
  std::string_view subject;  // or how it begins, with a number or an axis behind it: "tool-"
  std::string_view sentence;
};

// docs/results.md, Subject and binding. A is the angle of the spindle that carries the probe, C the turning axis.
constexpr auto kMeasurands = std::to_array<Measurand>({
    {"delay",
     "the time by which the stamps of the machine's positions are later than those of the probe's deflections, per "
     "axis; the "
     "gain turns deflections into machine axes with the spindle at A = 0, if the case states at which A it was "
     "measured"},
    {"centreline", "the position of the turning axis C relative to the axis of the spindle that carries the probe"},
    {"centreline-stylus",
     "the position of the turning axis C relative to the tip of the stylus with the spindle at A = 0: the offset of "
     "the tip from the axis of "
     "the spindle is part of it"},
    {"centreline-slide",
     "the position of the turning axis C of a chuck that the Z slide carries, relative to the axis of the spindle that "
     "carries the probe"},
    {"stylus-offset-",
     "the position of the tip of the stylus relative to the axis of the spindle that carries it, at A = 0"},
    {"spindle-offset", "the turning axis C minus the axis of the spindle that carries the probe"},
    {"spindle-tilt", "the tilt against Z of the axis of the spindle that carries the probe"},
    {"swivel-",
     "the displacement of the reported centre of a ball when the head swivels, relative to the upright head"},
    {"rotary-",
     "the deviations of a rotary axis about the point named here, relative to the axis at angle zero, and what they "
     "consist of: its location and orientation, and its error motions (ISO 230-1, ISO 230-7)"},
    {"screw-", "the extension of a ball screw by its sensor: gain, and the error of the measured face by sector"},
    {"screw-reference-", "the reading of the sensor that means no extension"},
    {"tool-", "the position of the tip of a tool relative to the reference of the head"},
    {"setter", "the position of the tool-setting device"},
    {"assembly-", "the length and the offset of a tool in its holder"},
    {"sensor-head-",
     "the matrix that turns the readings of a sensor head into machine axes, and its readings at the centre"},
    {"check", "the errors that a ball shows at different angles of the axes, against its accepted place"},
});

}  // namespace

std::string_view measurandOf(std::string_view subject) {
  // The longest that fits: "screw-reference-x" is no "screw-".
  const Measurand* found = nullptr;
  for (const auto& each : kMeasurands) {
    const bool fits = each.subject.ends_with('-') ? subject.starts_with(each.subject) : subject == each.subject;
    if (fits && (found == nullptr || each.subject.size() > found->subject.size())) found = &each;
  }
  return found == nullptr ? std::string_view{} : found->sentence;
}

}  // namespace probebox::report
