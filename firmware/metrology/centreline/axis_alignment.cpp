#include "firmware/metrology/centreline/axis_alignment.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "firmware/metrology/centreline/ball_readings.hpp"
#include "firmware/metrology/centreline/centreline.hpp"
#include "firmware/metrology/centreline/standing_axes.hpp"
#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/dataset/relative_sigma.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/fit_report.hpp"
#include "firmware/metrology/fit/rigid_motion.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr Quantity kAMinusC{.key = "A_minus_C_rad",
                            .about = "A_tilt_rad minus C_tilt_rad; only if C_tilt_rad is given",
                            .kind = QuantityKind::lean,
                            .compared = Compared::never,
                            .most = quantity::kMostLean_rad};
constexpr MethodColumn kTipLength{"tip_length_mm", ColumnRole::given};

// Readings of one ball or of two on one holder, with tips of several lengths or a shank, converted to the first ball
// (CN101976057, docs/metrology.md B.7, (B15), (B16)).
struct SpindleReadings {
  BallTable table;
  // One per row of the fit.
  std::vector<std::string> names;
  std::vector<double> lengths;  // mm
  std::vector<double> spreads;  // sd, in sigma_mm
  // By number of the tool, the set of its only tip. Empty without column `tool`.
  std::map<std::uint32_t, std::size_t> tip_of_tool;
};

constexpr MethodColumn kTool = column::kTool.orBe(MayBe::missing), kBall = column::kBall.orBe(MayBe::missing);

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kTwoDirections = 0.1;  // of the opposed sides, least over greatest
constexpr double kSameHeight = 1e-9;    // mm
constexpr std::string_view kTips = "readings";
constexpr std::size_t kMostTools = 64;  // as many as a machine may describe

// The second ball of a holder.
struct SecondBall {
  Vector3d offset{0, 0, 0};  // from the first at C = 0, mm
  Vector2d c_tilt{0, 0};     // displacement of the C axis over a unit of Z
};

Outcome<std::optional<SecondBall>, Refusal> secondBall(const Dataset& dataset) {
  TRY(const auto offset, configVector(dataset, "ball_offset_mm"));
  if (!offset) return std::optional<SecondBall>{};
  TRY(const auto tilt, configPlane(dataset, "C_tilt_rad"));
  SecondBall ball{.offset = Vector3d{offset->data()}};
  if (!tilt && std::abs(ball.offset.z()) > kSameHeight) {
    return Refusal{
        "missing-key",
        "config key 'C_tilt_rad' is missing: the second ball is at another height, so the direction of the C "
        "axis shows in its readings; measure that first (c-axis-alignment) and state its C_tilt_rad"};
  }
  if (tilt) ball.c_tilt = Vector2d{tilt->data()};
  return std::optional{ball};
}

// Takes the place of the second ball out of its readings.
std::optional<Refusal> toFirstBall(BallTable& balls, const Table& table, const SecondBall& second) {
  const auto& which = *table.column(kBall);
  for (std::size_t row = 0; row < which.size(); ++row) {
    if (which[row] == 1.0) continue;
    if (which[row] != 2.0) {
      return Refusal{"bad-ball", "table '" + table.name + "', row " + std::to_string(row + 1) + ": ball " +
                                     text(which[row]) + "; number the balls of the holder 1 and 2"};
    }
    auto& reading = balls.readings[row];
    reading.beyond = second.offset.head<2>();
    reading.at -= turn(reading.c) * second.offset.head<2>() + second.c_tilt * second.offset.z();
  }
  return std::nullopt;
}

Outcome<BallTable, Refusal> readTable(const Dataset& dataset, std::string_view name,
                                      std::vector<std::string_view> further, const std::optional<SecondBall>& second) {
  if (second) further.push_back(kBall);
  const bool by_tool = name == kTips && dataset.table(name) != nullptr && dataset.table(name)->column(kTool) != nullptr;
  auto balls = readBallTable(dataset, {.table = name,
                                       .lever = kTipLength,
                                       .further = std::move(further),
                                       .parted_by = by_tool ? kTool.name : std::string_view{}});
  if (!balls || !second) return balls;
  if (auto refusal = toFirstBall(*balls, *dataset.table(name), *second)) return *refusal;
  return balls;
}

// Whether every length was touched from opposite sides, in two directions: only then ball and shank cancel (B16).
std::optional<Refusal> refuseOneSided(const BallTable& shank) {
  for (std::size_t set = 0; set < shank.levers.size(); ++set) {
    Eigen::Matrix2d opposed = Eigen::Matrix2d::Zero();
    for (const auto& a : shank.readings) {
      for (const auto& b : shank.readings) {
        if (a.set != set || b.set != set || a.shank_side->dot(*b.shank_side) > kOppositeCosine) continue;
        opposed += *a.shank_side * a.shank_side->transpose();
      }
    }
    const Eigen::VectorXd spread = symmetricEigenvalues(opposed);
    if (spread[0] > kTwoDirections * spread[1]) continue;
    return Refusal{"not-opposed", "the shank at length " + text(shank.levers[set]) +
                                      " mm did not touch from opposite sides in two directions: touch the ball from +X "
                                      "and -X, +Y and -Y, with the spindle turned by 180 degrees in between"};
  }
  return std::nullopt;
}

std::optional<Refusal> takeSides(BallTable& shank, const Table& table) {
  const auto& ux = *table.column(column::kAlongX);
  const auto& uy = *table.column(column::kAlongY);
  for (std::size_t row = 0; row < shank.readings.size(); ++row) {
    const Vector2d side{ux[row], uy[row]};
    if (std::abs(side.norm() - 1.0) > kUnitLength) {
      return Refusal{"bad-direction", "table 'shank', row " + std::to_string(row + 1) +
                                          ": ux, uy must be a unit vector, from the ball to the side that was touched"};
    }
    shank.readings[row].shank_side = side.normalized();
  }
  return refuseOneSided(shank);
}

// numbered: the stops of both tables count as one.
void append(BallTable& tips, BallTable shank, bool numbered) {
  const double stops = numbered ? 0 : 1 + std::ranges::max(tips.readings, {}, &BallReading::stop).stop;
  for (auto& reading : shank.readings) {
    reading.set += tips.levers.size();
    reading.stop += stops;
    tips.readings.push_back(reading);
  }
  tips.levers.insert(tips.levers.end(), shank.levers.begin(), shank.levers.end());
  tips.warnings.insert(tips.warnings.end(), shank.warnings.begin(), shank.warnings.end());
  tips.centreLevers();
}

SpindleReadings withNames(BallTable table, std::size_t tips) {
  SpindleReadings all{.table = std::move(table), .names = {}, .lengths = {}, .spreads = {}, .tip_of_tool = {}};
  for (std::size_t k = 0; k < all.table.readings.size(); ++k) {
    const auto& reading = all.table.readings[k];
    const auto name = k < tips ? "readings " + std::to_string(k + 1) : "shank " + std::to_string(k - tips + 1);
    if (reading.shank_side) {
      all.names.push_back(name);
    } else {
      for (const auto part : kBallParts) all.names.push_back(name + ", " + std::string{part});
    }
    all.lengths.resize(all.names.size(), all.table.levers[reading.set]);
    all.spreads.resize(all.names.size(), reading.spread);
  }
  return all;
}

// A number of a tool.
bool isNumber(double value) {
  return value >= 1 && value < 1e9 && value == std::round(value);
}

std::optional<Refusal> badTool(const Table& table) {
  const auto* tools = table.column(kTool);
  if (tools == nullptr) return std::nullopt;
  const auto bad = std::ranges::find_if_not(*tools, isNumber);
  if (bad == tools->end()) {
    const std::set<double> all{tools->begin(), tools->end()};
    if (all.size() <= kMostTools) return std::nullopt;
    return Refusal{"bad-tool", "table '" + table.name + "' names " + std::to_string(all.size()) +
                                   " tools, each with a result of its own; give a case at most " +
                                   std::to_string(kMostTools)};
  }
  return Refusal{"bad-tool", "table '" + table.name + "', row " + std::to_string(bad - tools->begin() + 1) + ": tool " +
                                 text(*bad) + "; give the number of the tool that carries the tip, from 1 on"};
}

// Row of the tip of each tool; none for a tool that carries several, because none of them is its stylus.
std::map<std::uint32_t, std::size_t> tipOfTool(const Dataset& dataset, const BallTable& tips) {
  const auto* tools = dataset.table(kTips)->column(kTool);
  if (tools == nullptr) return {};
  std::map<std::uint32_t, std::set<std::size_t>> tips_of;
  for (std::size_t row = 0; row < tools->size(); ++row)
    tips_of[static_cast<std::uint32_t>((*tools)[row])].insert(tips.readings[row].set);
  std::map<std::uint32_t, std::size_t> only;
  for (const auto& [tool, sets] : tips_of) {
    if (sets.size() == 1) only.emplace(tool, *sets.begin());
  }
  return only;
}

// Numbers of the tools whose stylus offsets the readings may determine: column `tool`.
std::set<std::uint32_t> toolsOfTips(const Dataset& dataset) {
  const auto* table = dataset.table(kTips);
  const auto* tools = table == nullptr ? nullptr : table->column(kTool);
  if (tools == nullptr) return {};
  std::set<std::uint32_t> numbers;
  for (const double tool : *tools) {
    if (isNumber(tool)) numbers.insert(static_cast<std::uint32_t>(tool));
  }
  return numbers;
}

// Tables readings{tip_length_mm,A_rad,C_rad,x_mm,y_mm}, with `tool` where the numbers of the tools are known, and, for
// touches with a shank, shank{..,ux,uy}: the side from which it touched. shank_spread: sd of such a touch in units of
// that of a tip's coordinate. Where `readings` has a column `stop`, `shank` has it as well. Config: A_sense, C_sense;
// if both tables have a column `ball` (1 or 2), ball_offset_mm, the second ball from the first at C = 0, and
// C_tilt_rad, the direction of the C axis, unless both balls are at one height. Refuses: bad-ball, bad-tool,
// bad-direction, not-opposed, missing-key, and what readBallTable refuses.
Outcome<SpindleReadings, Refusal> readSpindleReadings(const Dataset& dataset, double shank_spread) {
  TRY(const auto second, secondBall(dataset));
  TRY(auto tips, readTable(dataset, kTips, {}, second));
  if (auto refusal = badTool(*dataset.table(kTips))) return *refusal;
  auto tip_of_tool = tipOfTool(dataset, tips);
  const std::size_t count = tips.readings.size();
  if (const auto* table = dataset.table("shank")) {
    const bool numbered = dataset.table(kTips)->column(kStop) != nullptr;
    std::vector<std::string_view> further{column::kAlongX, column::kAlongY};
    if (numbered) further.push_back(kStop);
    TRY(auto shank, readTable(dataset, "shank", std::move(further), second));
    if (auto refusal = takeSides(shank, *table)) return *refusal;
    for (auto& reading : shank.readings) reading.spread = shank_spread;
    append(tips, std::move(shank), numbered);
  }
  auto all = withNames(std::move(tips), count);
  all.tip_of_tool = std::move(tip_of_tool);
  return all;
}

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

constexpr Quantity kStylusOfTool{
    .key = "stylus_offset_of_tool_", .kind = QuantityKind::offset, .axes = "XY", .compared = Compared::never};

std::string stylusKey(std::uint32_t tool) {
  return std::string{kStylusOfTool} + std::to_string(tool) + "_mm";
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
  if (auto refusal = refuseSpindle(dataset)) return *refusal;
  TRY(const auto noise, statedNoise(dataset));
  TRY(const auto heights, configWord(dataset, "heights", kHeights));
  TRY(const auto table, readBallTable(dataset, {.lever = column::kZ, .same_lever_mm = kSameHeight_mm}));
  if (auto refusal = refuseSpan(table, column::kZ)) return *refusal;
  const auto ball =
      fitBall(table.readings, {.sloped = true, .arm_per_set = true, .stylus_per_set = false}, noise.noise);
  if (!ball) return ball.error();
  Answer answer = answerOf(dataset, table, *ball, noise);
  answer.readings(*dataset.table("readings"), kBallParts, column::kZ);
  const auto& parameters = ball->fit.parameters;
  const Eigen::MatrixXd rows = pick(2, 2, parameters.size());
  const bool by_slide = heights.value_or("rotating") == "slide";
  answer.promiseVector(by_slide ? quantity::kZSlide : quantity::kCTilt, parameters.segment<2>(2), rows);
  answer.promiseVector(quantity::kCentre, parameters.head(2), pick(0, 2, parameters.size()));
  answer.result().also.push_back(Estimate::scalar(quantity::kMeanHeight, table.mean_lever, std::nullopt));
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
  answer.promiseVector(quantity::kSpindleTilt, tilt, rows);
  if (c_tilt) {
    const Eigen::Vector2d c{c_tilt->data()};
    answer.promiseVector(kAMinusC, tilt - c, rows);
  }
  promiseStyli(answer, *ball, read);
  answer.result().convention = "x and y of the spindle axis per mm of Z, relative to Z";
  return std::move(answer).take(true);
}

namespace {

constexpr MethodColumn kCColumns[]{column::kZ.orBe(MayBe::set), column::kA, column::kC, column::kX, column::kY, kStop};
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
    key::kSpindle,
    key::kTauForTheRecord,
    {"heights", "rotating", "rotating (balls on the part) or slide (one ball, carried along Z)"}};
constexpr Quantity kCResults[]{quantity::kCTilt, quantity::kZSlide,
                               quantity::kCentre.as("x and y of the axis at the mean of the heights (mean_z_mm)")};
constexpr Quantity kCFurther[]{quantity::kMeanHeight};
constexpr std::string_view kAxisAlignmentUnobservable[]{
    "the axis separately from the straightness and squareness of the Z slide: the tilt is relative to Z"};

// A spindle that stood still leaves the tip, not its axis; a tip against a chuck on the slide is of no use to the box,
// nor is the slide of the second chuck.
std::optional<Subject> subjectOfAlignment(const Dataset& dataset) {
  const bool of_tip = spindleStoodStill(dataset);
  const auto heights = configWord(dataset, "heights", kHeights);
  if (heights && heights->value_or("rotating") == "slide")
    return of_tip || subjectOfSpindle(dataset, {}).of != 0 ? std::nullopt
                                                           : std::optional{Subject{SubjectKind::centreline_slide}};
  return subjectOfSpindle(dataset, of_tip ? SubjectKind::centreline_tip : SubjectKind::centreline);
}

constexpr MethodColumn kAColumns[]{kTipLength, column::kA, column::kC, column::kX, column::kY, kTool, kBall, kStop};
constexpr MethodColumn kSideColumns[]{kTipLength,      column::kA,      column::kC, column::kSetX, column::kSetY,
                                      column::kAlongX, column::kAlongY, kBall,      kStop};
constexpr MethodTable kATables[]{
    {"readings", kAColumns,
     "the ball, read with a tip of that length; column tool where the number of its tool is known, column ball where "
     "ball_offset_mm is stated, column stop as for c-axis-alignment",
     true},
    {"shank", kSideColumns, "where a shank touched: from the side (ux,uy); columns ball and stop as in readings",
     true}};
constexpr MethodKey kAKeys[]{
    key::kSigma,
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
    MethodKey{"C_tilt_rad", "", "tilt of the C axis, x y, from the alignment of C"}.upTo(quantity::kMostLean_rad)};
constexpr KnownQuantity kAKnown[]{
    {"sd_C_tilt_rad", "C_tilt_rad", KnownKind::value, false, "tilt of C"},
    {"sd_ball_offset_mm", "ball_offset_mm", KnownKind::value, false, "second ball of the holder"}};
constexpr Quantity kAResults[]{quantity::kSpindleTilt,
                               kAMinusC,
                               {.key = "stylus_offset_of_tool_N_mm",
                                .about = "tip of that tool from the spindle axis, x and y at A = 0; with column tool"}};
constexpr Quantity kAFurther[]{kStylusOfTool};
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
                        .kept_as = std::string{quantity::kStylusOffset},
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
                             .subject = {.about = Subject{SubjectKind::centreline}, .of = subjectOfAlignment}};

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
                             .subject = {.about = Subject{SubjectKind::spindle_tilt}},
                             .also_about = styliOfAlignment};

}  // namespace probebox::metrology
