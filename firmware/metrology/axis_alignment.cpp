#include "firmware/metrology/axis_alignment.hpp"

#include <array>
#include <string>
#include <utility>

#include "firmware/metrology/answer.hpp"
#include "firmware/metrology/ball_readings.hpp"

namespace probebox::metrology {
namespace {

constexpr std::array<std::string_view, 5> kKeys{"sigma_mm", "A_sense", "C_sense", "previous_tau_axis_s",
                                                "tool_direction"};
constexpr double kLeastSpan = 10.0;  // mm

struct Slope {
  BallTable table;
  BallFit ball;
  Answer answer;
};

Outcome<Slope, Refusal> slopeOf(const Dataset& dataset, std::string_view lever, BallModel model,
                                std::span<const std::string_view> keys) {
  const auto sigma = configSigma(dataset, "sigma_mm");
  if (!sigma) return sigma.error();
  auto table = readBallTable(dataset, lever);
  if (!table) return table.error();
  if (table->lever_span < kLeastSpan) {
    return Refusal{"span-too-small", "column '" + std::string{lever} + "' spans " + text(table->lever_span) +
                                         " mm, less than 10: read further apart"};
  }
  model.sloped = true;
  auto ball = fitBall(table->readings, model, sigma->value);
  if (!ball) return ball.error();
  Answer answer{dataset, ball->fit, sigma.value()};
  answer.readings(*dataset.table("readings"), kBallParts, lever);
  for (const auto& warning : table->warnings) answer.warn(warning);
  for (auto& warning : unusedKeys(dataset, keys)) answer.warn(std::move(warning));
  return Slope{std::move(table).value(), std::move(ball).value(), std::move(answer)};
}

}  // namespace

Outcome<Result, Refusal> solveCAxisAlignment(const Dataset& dataset) {
  auto slope = slopeOf(dataset, "z_mm", {.sloped = true, .arm_per_set = true, .stylus_per_set = false},
                       std::span{kKeys}.first(4));
  if (!slope) return slope.error();
  const auto& parameters = slope->ball.fit.parameters;
  const Eigen::MatrixXd rows = pick(2, 2, parameters.size());
  Answer& answer = slope->answer;
  answer.promiseVector("C_tilt_rad", parameters.segment<2>(2), rows);
  answer.alsoVector("centre_mm", parameters.head(2), pick(0, 2, parameters.size()));
  answer.result().also.push_back(Estimate::scalar("mean_z_mm", slope->table.mean_lever, std::nullopt));
  answer.alsoVector("taper_on_diameter", 2.0 * parameters.segment<2>(2), 2.0 * rows);
  if (slope->ball.turned == Turned::c_only) {
    answer.warn(
        "the spindle stood still: centre_mm is that of the tip, not of the spindle axis; the tilt is not affected");
  }
  answer.result().convention = "x and y of the axis per mm of Z; straightness of the Z slide is part of it";
  return std::move(answer).take(true);
}

Outcome<Result, Refusal> solveAAxisAlignment(const Dataset& dataset) {
  const auto direction = configSense(dataset, "tool_direction");
  if (!direction) return direction.error();
  auto slope = slopeOf(dataset, "tip_length_mm", {.sloped = true, .arm_per_set = false, .stylus_per_set = true}, kKeys);
  if (!slope) return slope.error();
  const auto& parameters = slope->ball.fit.parameters;
  const double sign = -direction.value();
  slope->answer.promiseVector("A_tilt_rad", sign * parameters.segment<2>(2), sign * pick(2, 2, parameters.size()));
  slope->answer.result().convention = "x and y of the spindle axis per mm of Z, relative to Z";
  return std::move(slope->answer).take(true);
}

}  // namespace probebox::metrology
