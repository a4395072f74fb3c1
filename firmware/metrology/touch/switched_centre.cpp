#include "firmware/metrology/touch/switched_centre.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/fit/sphere.hpp"

namespace probebox::metrology {
namespace {

constexpr std::size_t kFewestForScatter = 10;  // touches beyond one a speed

// Standard deviation of one touch along its motion, from the scatter of its two edges against each other: the
// difference of two independent edges has four times the variance of their mean. It holds the jitter of their stamps,
// which no other figure has. 0 if there are too few touches for it.
double scatterOfEdges(const std::vector<SwitchedTouch>& touches) {
  struct Sum {
    double n{}, late_s{};
  };
  std::map<double, Sum> of_speed;
  for (const auto& touch : touches) {
    auto& sum = of_speed[touch.speed_mm_s];
    ++sum.n;
    sum.late_s += touch.late_s;
  }
  if (touches.size() < of_speed.size() + kFewestForScatter) return 0;
  double squares = 0;
  for (const auto& touch : touches) {
    const auto& sum = of_speed[touch.speed_mm_s];
    squares += std::pow(touch.speed_mm_s * (touch.late_s - sum.late_s / sum.n), 2);
  }
  return std::sqrt(squares / static_cast<double>(touches.size() - of_speed.size()));
}

// Pooled standard deviation of one touch along its motion. The switch opens and closes once each, and both edges count
// half.
double pooledSigma(const std::vector<SwitchedTouch>& touches, double switch_sd_mm) {
  double variance = 0;
  for (const auto& touch : touches) variance += touch.sd_mm * touch.sd_mm / static_cast<double>(touches.size());
  return std::max(std::sqrt(variance + switch_sd_mm * switch_sd_mm / 2), scatterOfEdges(touches));
}

}  // namespace

Outcome<BallCentres, Refusal> switchedCentres(const std::vector<SwitchedTouch>& touches,
                                              const std::vector<std::size_t>& reading_of_touch, double switch_sd_mm) {
  const double sigma_mm = pooledSigma(touches, switch_sd_mm);
  BallCentres centres;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (reading_of_touch[i] == kAlone)
      centres.alone.push_back({.touch = i, .at_mm = touches[i].at_mm, .sd_mm = sigma_mm});
  }
  double sum_of_squares = 0;
  for (std::size_t reading = 0; std::ranges::find(reading_of_touch, reading) != reading_of_touch.end(); ++reading) {
    Rows3 points{std::ranges::count(reading_of_touch, reading), 3};
    Eigen::Index row = 0;
    for (std::size_t i = 0; i < touches.size(); ++i)
      if (reading_of_touch[i] == reading) points.row(row++) = touches[i].at_mm.transpose();
    const auto fit = fitSphere(points, {.sigma = sigma_mm});
    if (!fit) return Refusal{fit.error().name, "reading " + std::to_string(reading + 1) + ": " + fit.error().reason};
    centres.readings.push_back({.centre_mm = fit->parameters.head<3>(),
                                .sd_mm = fit->cofactor.diagonal().head<3>().cwiseSqrt(),
                                .radius_mm = fit->parameters[3]});
    sum_of_squares += fit->sumOfSquares();
    centres.dof += fit->dof;
  }
  if (centres.dof == 0) return centres;
  centres.chi2_reduced = sum_of_squares / static_cast<double>(centres.dof);
  const double wider = checkNoise(centres.chi2_reduced, {.dof = centres.dof}, {}).widening;
  for (auto& ball : centres.readings) ball.sd_mm *= wider;
  for (auto& touch : centres.alone) touch.sd_mm *= wider;
  return centres;
}

}  // namespace probebox::metrology
