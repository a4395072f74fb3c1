#include <algorithm>
#include <string>

#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/tool/tool_setter.hpp"

namespace probebox::metrology {
namespace {

constexpr std::string_view kSetterCentreColumns[]{"is_tool", "x_mm", "y_mm", "z_mm"};
constexpr std::string_view kSetterTouchColumns[]{"is_tool",   "nx",   "ny",   "nz",  "half_width_mm",
                                                 "radius_mm", "x_mm", "y_mm", "z_mm"};
constexpr std::string_view kSetterOffsetColumns[]{"B_deg", "x_mm", "y_mm", "z_mm"};
constexpr MethodTable kSetterTables[]{
    {"readings", kSetterCentreColumns,
     "machine position at the device's centre, of the probe above it by stylus_ball_radius_mm; B_deg too for several B",
     true},
    {"touches", kSetterTouchColumns,
     "instead of readings: machine position at contact with a face; B_deg too for several B"},
    {"probe_offsets", kSetterOffsetColumns,
     "for several B, instead of key probe_offset_mm: the probe's tip from the head's reference"}};
constexpr MethodKey kCentrelineResult{"centreline_result", "", "number of the centreline's result; for the record",
                                      "centreline"};
constexpr MethodKey kStylusOffsetResult{"stylus_offset_result", "",
                                        "number of the result that X and Y of probe_offset_mm are of; for the record",
                                        "stylus-offset-"};
constexpr MethodKey kSetterKeys[]{
    {"probe_offset_mm", "",
     "the probe's tip from the head's reference, x y z; needed unless table probe_offsets is given"},
    {"sd_probe_offset_mm", "", "standard uncertainty of its coordinates (k = 1)"},
    key::kSigma,
    {"stylus_ball_radius_mm", "0",
     "radius of the probe's stylus ball, added to radius_mm of its touches, or taken off z_mm of its readings"},
    {"sd_half_width_mm", "", "standard uncertainty of column half_width_mm (k = 1)"},
    {"accepted_setter_mm", "",
     "accepted position of the device, x y z; for several B one row per B, or one row for the first B"},
    {"setter_limit_mm", "", "largest distance of the device from its accepted position that is allowed"},
    {"centreline_mm", "", "x and y of the turning axis at centreline_z_mm; gives link_mm"},
    {"centreline_z_mm", "0", "Z of centreline_mm"},
    {"C_tilt_rad", "[0,0]", "tilt of the turning axis, x y per mm of Z"},
    {"sd_centreline_mm", "", "standard uncertainty of its coordinates (k = 1)"},
    {"sd_C_tilt_rad", "", "standard uncertainty of its components (k = 1)"},
    {"accepted_link_mm", "", "accepted link_mm, x y; one row per B"},
    {"tool", "", "number of the tool whose offset it is"},
    kCentrelineResult,
    kStylusOffsetResult,
    key::kTauForTheRecord};
constexpr KnownQuantity kSetterKnown[]{{"sd_probe_offset_mm", "probe_offset_mm", KnownKind::value, true},
                                       {"sd_probe_offset_mm", "probe_offsets", KnownKind::table, true},
                                       {"sd_stylus_ball_radius_mm", "stylus_ball_radius_mm", KnownKind::value},
                                       {"sd_half_width_mm", "half_width_mm", KnownKind::column},
                                       {"sd_centreline_mm", "centreline_mm", KnownKind::value, true},
                                       {"sd_C_tilt_rad", "C_tilt_rad", KnownKind::value, true}};
constexpr Quantity kSetterResults[]{quantity::kToolOffset, quantity::kSetter, quantity::kLink};
constexpr Quantity kSetterFurther[]{quantity::kEachB};
constexpr std::string_view kSetterUnobservable[]{
    "an error of probe_offset_mm: it biases tool and setting device with unit sensitivity"};

// Axes along which the device was touched from one side alone; none of the third, where it stands.
std::optional<std::string> oneFaced(const Dataset& dataset) {
  const Table* touches = dataset.table("touches");
  if (touches == nullptr || dataset.table("readings") != nullptr) return std::nullopt;
  std::string axes;
  for (const std::string_view column : {"nx", "ny"}) {
    const auto* normals = touches->column(column);
    if (normals == nullptr) return std::nullopt;
    const auto [least, most] = std::ranges::minmax(*normals);
    if (least < -0.1 && most > 0.1) continue;
    axes += (axes.empty() ? "" : " and ") + std::string{column == "nx" ? "X" : "Y"};
  }
  if (axes.empty()) return std::nullopt;
  return "along " + axes +
         " one face was touched: an error of half_width_mm is in setter_mm there, one of stylus_ball_radius_mm in "
         "tool_offset_mm, and the offset is that of the edge that touched, with the radius of the tool's nose unknown";
}

// link_mm alone is relative to it.
constexpr MethodKey kNotOfTool[]{kCentrelineResult};

std::optional<std::string> subjectOfTool(const Dataset& dataset) {
  return numberedSubject(dataset, "tool-", "tool");
}

std::vector<NamedSubject> alsoSetter(const Dataset&) {
  return {{.name = "setter", .needs = "setter_mm"}};
}

}  // namespace

const Method kToolSetter{.name = "tool-setter",
                         .title = "Offset of a tool from a setting device",
                         .equations = "(B22)-(B22c)",
                         .source = source::kMachine,
                         .solver = solveToolSetter,
                         .tables = kSetterTables,
                         .keys = kSetterKeys,
                         .known = kSetterKnown,
                         .results = kSetterResults,
                         .further = kSetterFurther,
                         .unobservable = kSetterUnobservable,
                         .undetermined = oneFaced,
                         .subject = {.name = {}, .of = subjectOfTool, .independent_of = kNotOfTool},
                         .also_about = alsoSetter};

}  // namespace probebox::metrology
