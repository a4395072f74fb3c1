#include "firmware/metrology/centreline/centreline.hpp"
#include "firmware/metrology/centreline/rim_steps.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"

namespace probebox::metrology {
namespace {

constexpr std::string_view kRimStepsColumns[]{"loop", "C_rad_clockwise_from_plus_y", "x_mm", "y_mm"};
constexpr std::string_view kStylusColumns[]{"A_rad", "x_mm", "y_mm"};
constexpr std::string_view kRimStepsContactColumns[]{"C1_rad", "C2_rad"};
constexpr MethodTable kRimStepsTables[]{
    {"readings", kRimStepsColumns,
     "the ball at an angle of C from the zero in force in that loop; z_mm too where wanted", true},
    {"stylus", kStylusColumns,
     "optional: tip of the stylus with the spindle at 0 and 180 degrees; of x_mm, y_mm, z_mm give the two across the "
     "spindle",
     true},
    {"contacts", kRimStepsContactColumns, "optional: angles of C at which the ball touches the stylus on either side",
     true}};
constexpr MethodKey kRimStepsKeys[]{
    key::kSigma,
    key::kSigmaC,
    {"sigma_contact_rad", "", "sd of an angle of C at a contact (k = 1), for the sd of contact_shift_rad"},
    {"level_limit_mm", "0.01", "largest difference of y at +theta and -theta that counts as level"},
    {"trust_C_angles", "true", "false if the angles of C are wrong: the result then follows from the steps"},
    key::kMeanHeight,
    key::kTauForTheRecord};
// Only half a turn of the spindle relates the tip to the spindle axis.
std::optional<std::string> subjectOfSteps(const Dataset& dataset) {
  return std::string{dataset.table("stylus") != nullptr ? kTurningAxis : kTurningAxisFromTip};
}

constexpr Quantity kRimStepsResults[]{quantity::kCentre.as("centre of rotation, x y"), quantity::kRadius};

}  // namespace

const Method kCentrelineBySteps{.name = "centreline-by-steps",
                                .title = "Centreline with limited access, step by step",
                                .equations = "(B8), (B11), (B25)-(B27), (B33)",
                                .source = source::kMachine,
                                .solver = solveCentrelineBySteps,
                                .tables = kRimStepsTables,
                                .keys = kRimStepsKeys,
                                .results = kRimStepsResults,
                                .unobservable = kCentrelineUnobservable,
                                .subject = {.name = kTurningAxis, .of = subjectOfSteps}};

}  // namespace probebox::metrology
