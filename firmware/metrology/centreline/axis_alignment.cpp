#include "firmware/metrology/centreline/axis_alignment.hpp"

#include <array>
#include <optional>
#include <string>
#include <utility>

#include "firmware/metrology/centreline/ball_readings.hpp"
#include "firmware/metrology/centreline/centreline.hpp"
#include "firmware/metrology/centreline/spindle_readings.hpp"
#include "firmware/metrology/centreline/standing_axes.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/relative_sigma.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 2> kHeights{"rotating", "slide"};

std::optional<Refusal> refuseSpan(const BallTable& table, std::string_view lever) {
  const double span = table.leverSpan();
  if (span >= kLeastLengthSpan_mm) return std::nullopt;
  return Refusal{"span-too-small",
                 "column '" + std::string{lever} + "' spans " + text(span) + " mm, less than 10: read further apart"};
}

Answer answerOf(const Dataset& dataset, const BallTable& table, const BallFit& ball, const StatedNoise& noise) {
  Answer answer{dataset, ball.fit, noise.sigma()};
  for (const auto& warnings : {noise.warnings, table.warnings}) {
    for (const auto& warning : warnings) answer.warn(warning);
  }
  return answer;
}

std::string stylusKey(std::uint32_t tool) {
  return "stylus_offset_of_tool_" + std::to_string(tool) + "_mm";
}

// (B11) by tool. Spindle and C turned together leave the stylus in the place of the ball.
void promiseStyli(Answer& answer, const BallFit& ball, const SpindleReadings& read) {
  if (ball.styli < 0) return;
  const auto& parameters = ball.fit.parameters;
  for (const auto& [tool, set] : read.tip_of_tool) {
    const auto at = ball.styli + static_cast<Eigen::Index>(2 * set);
    answer.promiseVector(stylusKey(tool), parameters.segment<2>(at), pick(at, 2, parameters.size()));
  }
}

}  // namespace

Outcome<Result, Refusal> solveCAxisAlignment(const Dataset& dataset) {
  TRY(const auto noise, statedNoise(dataset));
  TRY(const auto heights, configWord(dataset, "heights", kHeights));
  TRY(const auto table, readBallTable(dataset, {.lever = "z_mm", .same_lever_mm = kSameHeight_mm}));
  if (auto refusal = refuseSpan(table, "z_mm")) return *refusal;
  const auto ball =
      fitBall(table.readings, {.sloped = true, .arm_per_set = true, .stylus_per_set = false}, noise.noise);
  if (!ball) return ball.error();
  Answer answer = answerOf(dataset, table, *ball, noise);
  answer.readings(*dataset.table("readings"), kBallParts, "z_mm");
  const auto& parameters = ball->fit.parameters;
  const Eigen::MatrixXd rows = pick(2, 2, parameters.size());
  const bool by_slide = heights.value_or("rotating") == "slide";
  answer.promiseVector(by_slide ? "Z_slide_rad" : "C_tilt_rad", parameters.segment<2>(2), rows);
  answer.promiseVector("centre_mm", parameters.head(2), pick(0, 2, parameters.size()));
  answer.result().also.push_back(Estimate::scalar("mean_z_mm", table.mean_lever, std::nullopt));
  if (!by_slide) answer.alsoVector("taper_on_diameter", 2.0 * parameters.segment<2>(2), 2.0 * rows);
  if (ball->turned == Turned::c_only) {
    answer.warn(
        "the spindle stood still: centre_mm is that of the tip, not of the spindle axis; the slope is not affected");
  }
  answer.result().convention =
      by_slide ? "x and y of the chuck's slide per mm of Z: its squareness and straightness, not the direction of C"
               : "x and y of the axis per mm of Z; straightness of the Z slide is part of it";
  return std::move(answer).take(true);
}

Outcome<Result, Refusal> solveAAxisAlignment(const Dataset& dataset) {
  TRY(const auto direction, configSense(dataset, "tool_direction"));
  TRY(const auto noise, statedNoise(dataset));
  TRY(const auto c_tilt, configPlane(dataset, "C_tilt_rad"));
  TRY(const auto of_shank, relativeSigma(dataset, "sigma_shank_mm", noise.sigma()));
  TRY(const auto read, readSpindleReadings(dataset, of_shank.ratio));
  const BallTable& table = read.table;
  if (auto refusal = refuseSpan(table, kTipLength)) return *refusal;
  const auto ball =
      fitBall(table.readings, {.sloped = true, .arm_per_set = false, .stylus_per_set = true}, noise.noise);
  if (!ball) return ball.error();
  Answer answer = answerOf(dataset, table, *ball, noise);
  answer.readings(read.names, read.lengths, kTipLength);
  auto& residuals = answer.result().residuals.values;
  for (std::size_t k = 0; k < residuals.size(); ++k) residuals[k] *= read.spreads[k];
  for (const auto& warning : of_shank.warnings) answer.warn(warning);
  const auto& parameters = ball->fit.parameters;
  const double sign = -direction;
  const Eigen::MatrixXd rows = sign * pick(2, 2, parameters.size());
  const Eigen::Vector2d tilt = sign * parameters.segment<2>(2);
  answer.promiseVector("A_tilt_rad", tilt, rows);
  if (c_tilt) {
    const Eigen::Vector2d c{c_tilt->data()};
    answer.promiseVector("A_minus_C_rad", tilt - c, rows);
  }
  promiseStyli(answer, *ball, read);
  answer.result().convention = "x and y of the spindle axis per mm of Z, relative to Z";
  return std::move(answer).take(true);
}

namespace {

constexpr std::string_view kCColumns[]{"z_mm", "A_rad", "C_rad", "x_mm", "y_mm"};
constexpr MethodTable kCTables[]{{"readings", kCColumns,
                                  "a ball at the height z_mm, at angles of spindle (A) and C; column stop, the number "
                                  "of the stop of C, where rows of "
                                  "one stop are apart",
                                  true}};
constexpr MethodKey kCKeys[]{
    key::kSigma,
    key::kSigmaC,
    key::kASense,
    key::kCSense,
    key::kTauForTheRecord,
    {"heights", "rotating", "rotating (balls on the part) or slide (one ball, carried along Z)"}};
constexpr Quantity kCResults[]{quantity::kCTilt, quantity::kZSlide,
                               quantity::kCentre.as("x and y of the axis at the mean of the heights (mean_z_mm)")};
constexpr Quantity kCFurther[]{quantity::kMeanHeight};
constexpr std::string_view kAxisAlignmentUnobservable[]{
    "the axis separately from the straightness and squareness of the Z slide: the tilt is relative to Z"};

// A spindle that stood still leaves the tip, not its axis; a tip against a chuck on the slide is of no use to the box.
std::optional<std::string> subjectOfAlignment(const Dataset& dataset) {
  const bool of_tip = spindleStoodStill(dataset);
  const auto heights = configWord(dataset, "heights", kHeights);
  if (heights && heights->value_or("rotating") == "slide")
    return of_tip ? dataset.method : std::string{kTurningAxisOfSlide};
  return std::string{of_tip ? kTurningAxisFromTip : kTurningAxis};
}

constexpr std::string_view kAColumns[]{"tip_length_mm", "A_rad", "C_rad", "x_mm", "y_mm"};
constexpr std::string_view kShankColumns[]{"tip_length_mm", "A_rad", "C_rad", "x_mm", "y_mm", "ux", "uy"};
constexpr MethodTable kATables[]{
    {"readings", kAColumns,
     "the ball, read with a tip of that length; column tool where the number of its tool is known, column ball where "
     "ball_offset_mm is stated, column stop as for c-axis-alignment",
     true},
    {"shank", kShankColumns, "where a shank touched: from the side (ux,uy); columns ball and stop as in readings",
     true}};
constexpr MethodKey kAKeys[]{key::kSigma,
                             key::kSigmaC,
                             key::kLengthResults[0],
                             key::kLengthResults[1],
                             key::kLengthResults[2],
                             key::kLengthResults[3],
                             {"sigma_shank_mm", "sigma_mm", "standard deviation of one touch with the shank (k = 1)"},
                             key::kASense,
                             key::kCSense,
                             key::kTauForTheRecord,
                             {"tool_direction", "1", "1 where tools point along +Z from the spindle, -1 along -Z"},
                             {"ball_offset_mm", "", "second ball of the holder from the first at C = 0, x y z"},
                             {"C_tilt_rad", "", "tilt of the C axis, x y, from the alignment of C"}};
constexpr KnownQuantity kAKnown[]{{"sd_C_tilt_rad", "C_tilt_rad", KnownKind::value},
                                  {"sd_ball_offset_mm", "ball_offset_mm", KnownKind::value}};
constexpr Quantity kAResults[]{quantity::kSpindleTilt,
                               {.key = "A_minus_C_rad",
                                .about = "A_tilt_rad minus C_tilt_rad; only if C_tilt_rad is given",
                                .kind = QuantityKind::lean,
                                .compared = Compared::never},
                               {.key = "stylus_offset_of_tool_N_mm",
                                .about = "tip of that tool from the spindle axis, x and y at A = 0; with column tool"}};
constexpr Quantity kAFurther[]{
    {.key = "stylus_offset_of_tool_", .kind = QuantityKind::offset, .axes = "XY", .compared = Compared::never}};
constexpr std::string_view kAUnobservable[]{kAxisAlignmentUnobservable[0],
                                            "first harmonic of the spindle separately from the offsets of its tips"};

std::optional<std::string> undeterminedOfA(const Dataset& dataset) {
  if (auto by_angles = undeterminedByAngles(dataset)) return by_angles;
  const auto* readings = dataset.table("readings");
  if (readings == nullptr || readings->column(kTool) != nullptr) return std::nullopt;
  if (dataset.table("edges") != nullptr)
    return "offset of each tool's stylus: the lobes of the pre-travel turn with the stylus as its offset does";
  return "offset of each tool's stylus: no column 'tool' says which tool carries the tip";
}

std::vector<NamedSubject> styliOfAlignment(const Dataset& dataset) {
  std::vector<NamedSubject> subjects;
  for (const auto tool : toolsOfTips(dataset))
    subjects.push_back({.name = stylusOffsetSubject(tool),
                        .needs = stylusKey(tool),
                        .kept_as = "stylus_offset_mm",
                        .independent_of = key::kLengthResults});
  return subjects;
}

}  // namespace

const Method kCAxisAlignment{.name = "c-axis-alignment",
                             .title = "Direction of the C axis",
                             .equations = "(B4), (B14)",
                             .source = source::kMachine,
                             .solver = solveCAxisAlignment,
                             .tables = kCTables,
                             .keys = kCKeys,
                             .results = kCResults,
                             .further = kCFurther,
                             .unobservable = kAxisAlignmentUnobservable,
                             .undetermined = undeterminedByAngles,
                             .subject = {.name = kTurningAxis, .of = subjectOfAlignment}};

const Method kAAxisAlignment{.name = "a-axis-alignment",
                             .title = "Direction of the tool spindle",
                             .equations = "(B4), (B15), (B16)",
                             .source = source::kMachine,
                             .solver = solveAAxisAlignment,
                             .tables = kATables,
                             .keys = kAKeys,
                             .known = kAKnown,
                             .results = kAResults,
                             .further = kAFurther,
                             .unobservable = kAUnobservable,
                             .undetermined = undeterminedOfA,
                             .subject = {.name = "spindle-tilt"},
                             .also_about = styliOfAlignment};

}  // namespace probebox::metrology
