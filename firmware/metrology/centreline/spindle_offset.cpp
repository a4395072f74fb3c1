#include "firmware/metrology/centreline/spindle_offset.hpp"

#include <array>
#include <utility>

#include "firmware/metrology/centreline/ball_readings.hpp"
#include "firmware/metrology/dataset/unused_keys.hpp"
#include "firmware/metrology/fit/fit_report.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 4> kKeys{"sigma_mm", "A_sense", "C_sense", "previous_tau_axis_s"};

struct Offset {
  BallFit ball;
  Answer answer;
};

// What both methods have in common: the fit, and the offset of the axes.
Outcome<Offset, Refusal> offsetOf(const Dataset& dataset) {
  const auto sigma = configSigma(dataset, "sigma_mm");
  if (!sigma) return sigma.error();
  const auto table = readBallTable(dataset, {});
  if (!table) return table.error();
  auto ball = fitBall(table->readings, {}, sigma->value);
  if (!ball) return ball.error();
  if (ball->turned == Turned::c_only) {
    return Refusal{"spindle-not-turned",
                   "the spindle stood still: the offset of the stylus cannot be separated from the spindle axis; read "
                   "with the spindle at 0 and 180 degrees"};
  }
  if (ball->turned == Turned::spindle_only) {
    return Refusal{"c-not-turned",
                   "the C axis stood still: the offset of the ball cannot be separated from the C axis; read with C at "
                   "0 and 180 degrees"};
  }
  Answer answer{dataset, ball->fit, sigma.value()};
  answer.readings(*dataset.table("readings"), kBallParts, "C_rad");
  const auto& parameters = ball->fit.parameters;
  answer.promiseVector("offset_C_minus_A_mm", parameters.head(2), pick(0, 2, parameters.size()));
  for (const auto& warning : table->warnings) answer.warn(warning);
  for (auto& warning : unusedKeys(dataset, kKeys)) answer.warn(std::move(warning));
  return Offset{std::move(ball).value(), std::move(answer)};
}

}  // namespace

Outcome<Result, Refusal> solveSpindleOffsetFour(const Dataset& dataset) {
  auto offset = offsetOf(dataset);
  if (!offset) return offset.error();
  return std::move(offset->answer).take(true);
}

Outcome<Result, Refusal> solveSpindleOffset2x2(const Dataset& dataset) {
  auto offset = offsetOf(dataset);
  if (!offset) return offset.error();
  const BallFit& ball = offset->ball;
  if (ball.turned != Turned::both) {
    return Refusal{"dependent-angles",
                   "spindle and C turned together only: the offsets of stylus and ball cannot be separated; read all "
                   "four combinations of 0 and 180 degrees, or use spindle-offset-four"};
  }
  const auto& parameters = ball.fit.parameters;
  const auto rows = [&](Eigen::Index first) { return pick(first, 2, parameters.size()); };
  Answer& answer = offset->answer;
  answer.promiseVector("stylus_offset_mm", parameters.segment<2>(ball.styli), rows(ball.styli));
  answer.alsoVector("ball_offset_mm", parameters.segment<2>(ball.arms), rows(ball.arms));
  answer.alsoVector("tip_to_C_mm", parameters.head(2) - parameters.segment<2>(ball.styli), rows(0) - rows(ball.styli));
  return std::move(answer).take(true);
}

}  // namespace probebox::metrology
