#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/tool/tool_setter.hpp"

namespace probebox::metrology {
namespace {

constexpr std::string_view kCentreColumns[]{"is_tool", "x_mm", "y_mm", "z_mm"};
constexpr std::string_view kTouchColumns[]{"is_tool",   "nx",   "ny",   "nz",  "half_width_mm",
                                           "radius_mm", "x_mm", "y_mm", "z_mm"};
constexpr std::string_view kOffsetColumns[]{"B_deg", "x_mm", "y_mm", "z_mm"};
constexpr MethodTable kTables[]{
    {"readings", kCentreColumns, "machine position at the device's centre; B_deg too for several B", true},
    {"touches", kTouchColumns, "instead of readings: machine position at contact with a face; B_deg too for several B"},
    {"probe_offsets", kOffsetColumns, "for several B, in the place of probe_offset_mm"}};
constexpr MethodKey kKeys[]{
    {"probe_offset_mm", "", "the probe's tip from the head's reference, x y z; needed but for several B"},
    {"sd_probe_offset_mm", "", "standard uncertainty of its coordinates (k = 1)"},
    key::kSigma,
    {"accepted_setter_mm", "", "accepted place of the device; a row a B"},
    {"setter_limit_mm", "", "what the device may have moved by"},
    {"centreline_mm", "", "x and y of the turning axis at centreline_z_mm; gives link_mm"},
    {"centreline_z_mm", "0", "Z of centreline_mm"},
    {"C_tilt_rad", "[0,0]", "tilt of the turning axis, x y per mm of Z"},
    {"sd_centreline_mm", "", "standard uncertainty of its coordinates (k = 1)"},
    {"sd_C_tilt_rad", "", "standard uncertainty of its components (k = 1)"},
    {"accepted_link_mm", "", "accepted link; a row a B"},
    {"tool", "", "number of the tool whose offset it is"},
    key::kTauForTheRecord};
constexpr KnownQuantity kKnown[]{{"sd_probe_offset_mm", "probe_offset_mm", KnownKind::value, true},
                                 {"sd_probe_offset_mm", "probe_offsets", KnownKind::table, true},
                                 {"sd_centreline_mm", "centreline_mm", KnownKind::value, true},
                                 {"sd_C_tilt_rad", "C_tilt_rad", KnownKind::value, true}};
constexpr MethodResult kResults[]{{"tool_offset_mm", "tool tip from the head's reference, x y z; a row a B"},
                                  {"setter_mm", "place of the device, x y z; a row a B"},
                                  {"link_mm", "the device from the turning axis, x y, with centreline_mm; a row a B"}};
constexpr std::string_view kUnobservable[]{
    "an error of probe_offset_mm: it biases tool and setting device with unit sensitivity"};

std::optional<std::string> subjectOfTool(const Dataset& dataset) {
  return numberedSubject(dataset, "tool-", "tool");
}

}  // namespace

const Method kToolSetter{.name = "tool-setter",
                         .title = "Offset of a tool from a setting device",
                         .equations = "(B22)-(B22c)",
                         .source = source::kMachine,
                         .solver = solveToolSetter,
                         .tables = kTables,
                         .keys = kKeys,
                         .known = kKnown,
                         .results = kResults,
                         .unobservable = kUnobservable,
                         .subject = {.name = {}, .of = subjectOfTool},
                         .also_about = {.name = "setter", .of = nullptr, .needs = "setter_mm"}};

}  // namespace probebox::metrology
