#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/rotary/rotary_axis_errors.hpp"
#include "firmware/metrology/rotary/rotary_joint_errors.hpp"

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
    {"axis", "", "its letter, for the box"},
    key::kSigma,
    {"sigma_axial_mm", "sigma_mm", "standard deviation of a coordinate along the axis (k = 1)"},
    key::kSigmaAngle,
    {"sigma_third_mm", "0", "standard deviation of a coordinate of the certificate (k = 1)"},
    {"sigma_offset_mm", "0", "standard deviation of what all readings are off by together (k = 1)"},
    {"station_correction", "false", "true takes out the error of the linear axes at each station"},
    {kStationRadiusKey, "30", "how close a ball has to come to a station; with station_correction"},
    key::kTauForTheRecord,
    {"tool_vector_mm", "", "of the sensor head; for the record"},
    {"sensor_matrix", "", "of the sensor head; for the record"},
    {"sensor_head_result", "", "number of the sensor head's calibration; for the record",
     "sensor-head-"}};
constexpr KnownQuantity kKnown[]{{"sd_certificate_mm", "third", KnownKind::table}};
constexpr MethodResult kAxisErrorsResults[]{
    {"six_errors", "a row an angle: three translations in mm, three rotations in rad"},
    {"location_mm", "of the axis, across it, where four or more angles are spread wider than 60 degrees"},
    {"tilt_rad", "of the axis, likewise"}};
constexpr std::string_view kAxisErrorsUnobservable[]{
    "XOC and YOC separately from position-dependent first harmonics (EXC, EYC)",
    "any error at the reference angle, and errors of the linear axes that all angles share"};

std::optional<std::string> subjectOfAxis(const Dataset& dataset) {
  return letteredSubject(dataset, "rotary-", "abcdefghijklmnopqrstuvwxyz");
}

}  // namespace

const Method kRotaryAxisErrors{.name = "rotary-axis-errors",
                               .title = "Errors of a rotary axis",
                               .equations = "(E2)-(E12)",
                               .source = source::kRotary,
                               .solver = solveRotaryAxisErrors,
                               .tables = kAxisErrorsTables,
                               .keys = kAxisErrorsKeys,
                               .known = kKnown,
                               .results = kAxisErrorsResults,
                               .unobservable = kAxisErrorsUnobservable,
                               .subject = {.name = {}, .of = subjectOfAxis}};

}  // namespace probebox::metrology
