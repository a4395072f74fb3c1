#include "firmware/metrology/centreline/check_quantities.hpp"
#include "firmware/metrology/centreline/periodic_check.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/verdict.hpp"

namespace probebox::metrology {
namespace {

constexpr std::string_view kPeriodicCheckCentreColumns[]{"B_deg", "C_deg", "A_deg", "x_mm", "y_mm", "z_mm"};
constexpr std::string_view kPeriodicCheckXColumns[]{"B_deg", "C_deg", "A_deg", "x_mm"};
constexpr std::string_view kPeriodicCheckZColumns[]{"B_deg", "C_deg", "A_deg", "z_mm"};
constexpr MethodTable kPeriodicCheckTables[]{
    {"centres", kPeriodicCheckCentreColumns, "centre of the ball at B 0, 45 or 90, C and A 0 or 180", true},
    {"x_touch", kPeriodicCheckXColumns, "a touch along X at B = 90; needed if table centres is given", true},
    {"z_touch", kPeriodicCheckZColumns, "a touch along Z at B = 0; needed if table centres is given", true}};
constexpr std::string_view kAccepted = "the value in the accepted calibration";
constexpr std::string_view kSdAccepted =
    "standard deviation of the accepted value (k = 1), included in U of the deviation; without it, taken as exact";
constexpr std::string_view kLimit = "largest deviation from the accepted value that is allowed";
constexpr MethodKey kPeriodicCheckKeys[]{
    {"effective_ball_radius_mm", kNeeded, "of ball plus stylus ball"},
    {"expected_ball_centre_z_mm", kNeeded, "Z of the ball's centre at B = 0"},
    {"x_is_radius", kNeeded, "false where X is programmed in diameters"},
    key::kSigma,
    key::kSigmaC,
    key::kLengthResults[0],
    key::kLengthResults[1],
    key::kLengthResults[2],
    key::kLengthResults[3],
    {"sigma_touch_mm", "sigma_mm", "standard deviation of one touch (k = 1)"},
    {"sigma_stop_B90_mm", "0", "standard deviation of Zcen_B90_mm due to a stop of B (k = 1)"},
    {"sigma_Zcen_B90_mm", "sigma_mm", "standard deviation of the height of one centre at B = 90 (k = 1)"},
    {"limit_mm", "", "the same for every value without a limit of its own"},
    key::kTauForTheRecord,
    {"accepted_ball_offset_x_mm", "", kAccepted},
    {"sd_accepted_ball_offset_x_mm", "", kSdAccepted},
    {"limit_ball_offset_x_mm", "limit_mm", kLimit},
    {"accepted_ball_offset_y_mm", "", kAccepted},
    {"sd_accepted_ball_offset_y_mm", "", kSdAccepted},
    {"limit_ball_offset_y_mm", "limit_mm", kLimit},
    {"accepted_stylus_offset_x_mm", "", kAccepted},
    {"sd_accepted_stylus_offset_x_mm", "", kSdAccepted},
    {"limit_stylus_offset_x_mm", "limit_mm", kLimit},
    {"accepted_stylus_offset_y_mm", "", kAccepted},
    {"sd_accepted_stylus_offset_y_mm", "", kSdAccepted},
    {"limit_stylus_offset_y_mm", "limit_mm", kLimit},
    {"accepted_Xcen_B0_mm", "", kAccepted},
    {"sd_accepted_Xcen_B0_mm", "", kSdAccepted},
    {"limit_Xcen_B0_mm", "limit_mm", kLimit},
    {"accepted_Ycen_B0_mm", "", kAccepted},
    {"sd_accepted_Ycen_B0_mm", "", kSdAccepted},
    {"limit_Ycen_B0_mm", "limit_mm", kLimit},
    {"accepted_z_offset_error_mm", "0", kAccepted},
    {"sd_accepted_z_offset_error_mm", "", kSdAccepted},
    {"limit_z_offset_error_mm", "limit_mm", kLimit},
    {"accepted_Ycen_B45_mm", "", kAccepted},
    {"sd_accepted_Ycen_B45_mm", "", kSdAccepted},
    {"limit_Ycen_B45_mm", "limit_mm", kLimit},
    {"accepted_Ycen_B90_mm", "", kAccepted},
    {"sd_accepted_Ycen_B90_mm", "", kSdAccepted},
    {"limit_Ycen_B90_mm", "limit_mm", kLimit},
    {"accepted_Zcen_B90_mm", "", kAccepted},
    {"sd_accepted_Zcen_B90_mm", "", kSdAccepted},
    {"limit_Zcen_B90_mm", "limit_mm", kLimit},
    {"accepted_x_offset_error_mm", "0", kAccepted},
    {"sd_accepted_x_offset_error_mm", "", kSdAccepted},
    {"limit_x_offset_error_mm", "limit_mm", kLimit}};
constexpr KnownQuantity kKnown[]{{"sd_effective_ball_radius_mm", "effective_ball_radius_mm"},
                                 {"sd_expected_ball_centre_z_mm", "expected_ball_centre_z_mm", KnownKind::value}};
constexpr Quantity kPeriodicCheckResults[]{
    {.key = kXAtLevel.key, .about = "mean X of the ball at B = 0", .kind = QuantityKind::offset},
    {.key = kYAtLevel.key, .about = "mean Y at B = 0", .kind = QuantityKind::offset},
    {.key = kZAtLevel.key, .about = "Z offset error at B = 0 (B24)", .kind = QuantityKind::error},
    {.key = kYAt45.key, .about = "mean Y at B = 45", .kind = QuantityKind::offset},
    {.key = kYAt90.key, .about = "mean Y at B = 90", .kind = QuantityKind::offset},
    {.key = kXAt90.key, .about = "X offset error at B = 90 (B24)", .kind = QuantityKind::error}};
constexpr Quantity kPeriodicCheckFurther[]{
    quantity::kDeviation, quantity::kStylusOffsetX, quantity::kStylusOffsetY, {.key = kVerdict}, {.key = kWorstRatio}};
constexpr std::string_view kPeriodicCheckUnobservable[]{
    "run-out of ball and stylus at B = 45 and 90: it cancels",
    "x_offset_error_mm and z_offset_error_mm separately from errors of the ball's radius and expected centre"};

std::vector<NamedSubject> stylusOfCheck(const Dataset& dataset) {
  return {{.name = stylusOffsetSubject(probeToolOf(dataset)),
           .needs = "stylus_offset_x_mm",
           .independent_of = key::kLengthResults}};
}

}  // namespace

const Method kPeriodicCheck{.name = "periodic-check",
                            .title = "Periodic check",
                            .equations = "(B23), (B24)",
                            .source = source::kMachine,
                            .solver = solvePeriodicCheck,
                            .judge = judgePeriodicCheck,
                            .tables = kPeriodicCheckTables,
                            .keys = kPeriodicCheckKeys,
                            .known = kKnown,
                            .results = kPeriodicCheckResults,
                            .further = kPeriodicCheckFurther,
                            .unobservable = kPeriodicCheckUnobservable,
                            .subject = {.name = kCheckSubject},
                            .also_about = stylusOfCheck};

}  // namespace probebox::metrology
