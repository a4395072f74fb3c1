#include "firmware/metrology/centreline/spindle_offset.hpp"

#include <array>
#include <span>
#include <utility>

#include "firmware/metrology/centreline/ball_readings.hpp"
#include "firmware/metrology/centreline/standing_axes.hpp"
#include "firmware/metrology/dataset/method_parts.hpp"
#include "firmware/metrology/fit/fit_report.hpp"

namespace probebox::metrology {
namespace {

struct Offset {
  BallFit ball;
  Answer answer;
};

// Part that both methods share: the fit, and the offset of the axes.
Outcome<Offset, Refusal> offsetOf(const Dataset& dataset) {
  TRY(const auto noise, statedNoise(dataset));
  TRY(const auto table, readBallTable(dataset, {}));
  TRY(auto ball, fitBall(table.readings, {}, noise.noise));
  if (ball.turned == Turned::c_only) {
    return Refusal{"spindle-not-turned",
                   "the spindle stood still: the offset of the stylus cannot be separated from the spindle axis; read "
                   "with the spindle at 0 and 180 degrees"};
  }
  if (ball.turned == Turned::spindle_only) {
    return Refusal{"c-not-turned",
                   "the C axis stood still: the offset of the ball cannot be separated from the C axis; read with C at "
                   "0 and 180 degrees"};
  }
  Answer answer{dataset, ball.fit, noise.sigma()};
  answer.readings(*dataset.table("readings"), kBallParts, column::kC);
  const auto& parameters = ball.fit.parameters;
  answer.promiseVector(quantity::kOffsetCMinusA, parameters.head(2), pick(0, 2, parameters.size()));
  for (const auto& warnings : {noise.warnings, table.warnings}) {
    for (const auto& warning : warnings) answer.warn(warning);
  }
  return Offset{std::move(ball), std::move(answer)};
}

}  // namespace

Outcome<Result, Refusal> solveSpindleOffsetFour(const Dataset& dataset) {
  TRY(auto offset, offsetOf(dataset));
  return std::move(offset.answer).take(true);
}

Outcome<Result, Refusal> solveSpindleOffset2x2(const Dataset& dataset) {
  TRY(auto offset, offsetOf(dataset));
  const BallFit& ball = offset.ball;
  if (ball.turned != Turned::both) {
    return Refusal{"dependent-angles",
                   "spindle and C turned together only: the offsets of stylus and ball cannot be separated; read all "
                   "four combinations of 0 and 180 degrees, or use spindle-offset-four"};
  }
  const auto& parameters = ball.fit.parameters;
  const auto rows = [&](Eigen::Index first) { return pick(first, 2, parameters.size()); };
  Answer& answer = offset.answer;
  answer.promiseVector(quantity::kStylusOffset, parameters.segment<2>(ball.styli), rows(ball.styli));
  answer.alsoVector("ball_offset_mm", parameters.segment<2>(ball.arms), rows(ball.arms));
  answer.alsoVector("tip_to_C_mm", parameters.head(2) - parameters.segment<2>(ball.styli), rows(0) - rows(ball.styli));
  return std::move(answer).take(true);
}

namespace {

constexpr MethodColumn kSpindleOffsetColumns[]{column::kA, column::kC, column::kX, column::kY, kStop};
constexpr MethodTable kSpindleOffsetTables[]{
    {"readings", kSpindleOffsetColumns, "the ball at angles of spindle (A) and C; column stop as for c-axis-alignment",
     true}};
constexpr MethodKey kSpindleOffsetKeys[]{key::kSigma, key::kSigmaC, key::kASense, key::kCSense, key::kTauForTheRecord};
constexpr Quantity kSpindleOffsetResults[]{quantity::kOffsetCMinusA, quantity::kStylusOffset};
constexpr MethodSubject kSpindleOffset{.about = Subject{SubjectKind::spindle_offset}};
constexpr std::string_view kSpindleOffsetUnobservable[]{
    "first harmonics of C and of the spindle separately from the offsets of ball and stylus"};

std::vector<NamedSubject> stylusOfFourPoses(const Dataset& dataset) {
  return {{.name = stylusOffsetSubject(probeToolOf(dataset)), .needs = std::string{quantity::kStylusOffset}}};
}

}  // namespace

const Method kSpindleOffset2x2{.name = "spindle-offset-2x2",
                               .title = "C axis against spindle, four poses",
                               .equations = "(B4), (B10)-(B12)",
                               .source = source::kMachine,
                               .solver = solveSpindleOffset2x2,
                               .tables = kSpindleOffsetTables,
                               .keys = kSpindleOffsetKeys,
                               .results = kSpindleOffsetResults,
                               .unobservable = kSpindleOffsetUnobservable,
                               .undetermined = undeterminedByAngles,
                               .subject = kSpindleOffset,
                               .also_about = stylusOfFourPoses};

const Method kSpindleOffsetFour{.name = "spindle-offset-four",
                                .title = "C axis against spindle",
                                .equations = "(B4), (B9)",
                                .source = source::kMachine,
                                .solver = solveSpindleOffsetFour,
                                .tables = kSpindleOffsetTables,
                                .keys = kSpindleOffsetKeys,
                                .results = std::span{kSpindleOffsetResults}.first(1),
                                .undetermined = undeterminedByAngles,
                                .subject = kSpindleOffset};

}  // namespace probebox::metrology
