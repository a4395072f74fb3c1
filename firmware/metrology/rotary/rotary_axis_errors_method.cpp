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
constexpr MethodResult kAxisErrorsResults[]{
    {"six_errors", "one row per angle: three translations in mm, three rotations in rad"},
    {"location_mm",
     "position of the axis across its direction; only for four or more angles over more than 60 degrees"},
    {"tilt_rad", "tilt of the axis; under the same condition"}};
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
