#include <array>
#include <cstdio>

#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "firmware/metrology/rotary/rotary_joint_errors.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

constexpr std::string_view kAxisErrorsFirstColumns[]{"phi_rad", "ball", "x_mm", "y_mm", "z_mm"};
constexpr std::string_view kAxisErrorsBallColumns[]{"ball", "x_mm", "y_mm", "z_mm"};
constexpr MethodTable kAxisErrorsTables[]{
    {"first", kAxisErrorsFirstColumns,
     "centre of a ball with the axis turned to phi; column mount where there are several", true},
    {"second", kAxisErrorsBallColumns, "centre of a ball with the axis at zero; column mount where there are several",
     true},
    {"third", kAxisErrorsBallColumns, "centre of a ball in the certificate, in the plate's own frame"}};
constexpr MethodKey kAxisErrorsKeys[]{
    {"axis_point_mm", kNeeded, "a point of the nominal axis"},
    {"axis_direction", kNeeded, "unit vector along the nominal axis"},
    {"axis", "", "letter of the axis, needed by the box"},
    key::kSigma,
    {"sigma_axial_mm", "sigma_mm", "standard deviation of a coordinate along the axis (k = 1)"},
    key::kSigmaAngle,
    {"sigma_third_mm", "0", "standard deviation of a coordinate of the certificate (k = 1)"},
    {"sigma_offset_mm", "0", "standard deviation of the error that all readings share (k = 1)"},
    {"station_correction", "false", "true: remove the error of the linear axes at each station"},
    {kStationRadiusKey, "30", "largest distance of a ball from its station, mm; with station_correction"},
    key::kTauForTheRecord,
    {"tool_vector_mm", "", "from the machine's position to the reference of the sensor head; for the record"},
    {"sensor_matrix", "", "units of the sensors per mm, one row per sensor; for the record"},
    {"sensor_head_result", "", "number of the sensor head's calibration; for the record", "sensor-head-"}};
constexpr KnownQuantity kKnown[]{{"sd_certificate_mm", "third", KnownKind::table}};
constexpr Quantity kAxisErrorsResults[]{quantity::kSixErrors, quantity::kLocation, quantity::kTilt};
constexpr Quantity kAxisErrorsFurther[]{
    quantity::kErrorMotions,  quantity::kTiltMotions,
    quantity::kErrorAngles,   quantity::kAxisPoint,
    quantity::kAxisDirection, {.key = "rotations_rad", .kind = QuantityKind::lean}};  // partsOf()
constexpr std::string_view kAxisErrorsUnobservable[]{
    "XOC and YOC separately from position-dependent first harmonics (EXC, EYC)",
    "any error at the reference angle, and errors of the linear axes that all angles share"};

std::optional<std::string> subjectOfAxis(const Dataset& dataset) {
  return letteredSubject(dataset, "rotary-", "abcdefghijklmnopqrstuvwxyz");
}

}  // namespace

std::string deviationKey(std::string_view axis, std::size_t error, double angle_rad) {
  constexpr std::array<const char*, 6> kErrors{"X", "Y", "Z", "A", "B", "C"};
  std::array<char, 48> at{};
  std::snprintf(at.data(), at.size(), "_at_%.6g_deg_%s", degrees(angle_rad), error < 3 ? "mm" : "rad");
  return std::string{quantity::kDeviation.key} + kErrors.at(error) + std::string{axis} + at.data();
}

const Method kRotaryAxisErrors{.name = "rotary-axis-errors",
                               .title = "Errors of a rotary axis",
                               .equations = "(E2)-(E12)",
                               .source = source::kRotary,
                               .solver = solveRotaryAxisErrors,
                               .tables = kAxisErrorsTables,
                               .keys = kAxisErrorsKeys,
                               .known = kKnown,
                               .results = kAxisErrorsResults,
                               .further = kAxisErrorsFurther,
                               .unobservable = kAxisErrorsUnobservable,
                               .subject = {.name = {}, .of = subjectOfAxis}};

}  // namespace probebox::metrology
