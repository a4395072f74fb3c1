#include "firmware/metrology/touch/constant_speed_window.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/touch/sample_correlation.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

constexpr std::size_t kLeastOfWindow = 3;
constexpr double kMissingPeriods = 3.5;  // between samples: two may be lost anywhere
// The most that a sawtooth of one step, some turns of it long, bends in the coefficient of (share of the window)^2.
constexpr double kBendOfSteps = 2.9;

// Speed change over the window, relative, where it stands out of the noise; 0 where it does not. noise: least deviation
// of one sample to reckon with, as a few residuals may be small by chance. bend: that the encoder's steps may feign.
double speedChange(std::span<const double> times, std::span<const double> values, double noise, double bend) {
  if (times.size() < 4) return 0.0;
  const auto n = static_cast<Eigen::Index>(times.size());
  const Eigen::Map<const Eigen::ArrayXd> t{times.data(), n};
  const Eigen::Map<const Eigen::ArrayXd> x{values.data(), n};
  const double length = times.back() - times.front();
  const Eigen::ArrayXd s = (t - t[0]) / length - 0.5;
  Eigen::MatrixXd basis{n, 3};
  basis << Eigen::ArrayXd::Ones(n), s, s.square();
  const Eigen::Matrix3d normal = basis.transpose() * basis;
  const Eigen::Vector3d fitted = solveCholesky(normal, basis.transpose() * (x - x[0]).matrix());
  const double variance = ((x - x[0]).matrix() - basis * fitted).squaredNorm() / static_cast<double>(n - 3);
  const double sd = std::sqrt(std::max(variance, noise * noise) * inverse(normal)(2, 2)) + kCaseDigits;
  // With few samples the sd itself is uncertain.
  const double limit = 5.0 * (1.0 + 4.0 / static_cast<double>(n - 3));
  return std::abs(fitted[2]) > limit * sd + bend ? std::abs(2.0 * fitted[2] / fitted[1]) : 0.0;
}

// The line through a run without its spikes.
Steady lineOf(const Seen& seen, const SteadyRun& steady, std::size_t from) {
  const auto& stream = seen.stream;
  Steady result{{}, {}, {from + steady.run.begin, from + steady.run.end}, {}, Eigen::Matrix3d::Zero()};
  if (steady.spikes.empty()) {
    result.line = fitLine(stream.timesOf(result.used), stream.valuesOf(result.used));
    result.rounding = Rounding{stream.timesOf(result.used), result.line, seen.steps};
    result.neighbours = neighbourProducts(stream.timesOf(result.used), stream.valuesOf(result.used), result.line);
    return result;
  }
  std::vector<double> times;
  std::vector<Eigen::Index> rows;
  for (std::size_t k = steady.run.begin; k < steady.run.end; ++k) {
    if (std::ranges::binary_search(steady.spikes, k)) {
      result.spikes.push_back(stampOf(seen.name, stream.times[from + k]));
      continue;
    }
    times.push_back(stream.times[from + k]);
    rows.push_back(static_cast<Eigen::Index>(from + k));
  }
  const Rows3 values = stream.values(rows, Eigen::all);
  result.line = fitLine(times, values);
  result.rounding = Rounding{times, result.line, seen.steps};
  result.neighbours = neighbourProducts(times, values, result.line);
  return result;
}

// Slip and bounce make the residuals larger than the record's own noise, or many of the samples spikes.
std::optional<Refusal> tooRough(const Seen& seen, const Steady& steady) {
  const auto dof = static_cast<double>(steady.line.n - 2);
  const double rms = std::sqrt(steady.line.scatterAlong(seen.direction) / dof);
  const double sigma = std::max(
      {seen.noise, kCaseDigits,
       localDeviation(seen.stream.timesOf(steady.used), seen.stream.along(seen.direction, steady.used), Trim::light)});
  const bool many_spikes = steady.spikes.size() > std::max<std::size_t>(1, steady.used.size() / 10);
  // The rms of one residual or two is large by chance more often.
  if (rms <= 3.0 * (1.0 + 1.0 / dof) * sigma && !many_spikes) return std::nullopt;
  return aboutTouch(seen.touch, "residual-too-large",
                    "the " + seen.name + " samples lie " + text(rms) +
                        " about the fitted line, where the record's noise is " + text(sigma) +
                        " (slip or bounce); touch again");
}

}  // namespace

std::string stampOf(const std::string& stream, double time) {
  return stream + " at " + text(time) + " s";
}

Refusal aboutTouch(const Touch& touch, std::string name, const std::string& what) {
  return {std::move(name), touch.plan.name + ": " + what};
}

std::optional<Refusal> tooSparse(const Seen& seen, Run run) {
  const auto times = seen.stream.timesOf(run);
  if (times.size() < kLeastOfWindow) {
    return aboutTouch(
        seen.touch, "too-few-samples",
        std::to_string(times.size()) + " " + seen.name +
            " samples at constant speed, three are needed; retract more slowly or further, or sample faster");
  }
  double widest = 0.0;
  for (std::size_t k = 1; k < times.size(); ++k) widest = std::max(widest, times[k] - times[k - 1]);
  if (widest > std::max(0.4 * (times.back() - times.front()), kMissingPeriods * seen.usual_s)) {
    return aboutTouch(seen.touch, "gap",
                      "the " + seen.name + " samples have a gap of " + text(widest) +
                          " s during the retract; find out why samples are lost and measure again");
  }
  return std::nullopt;
}

Outcome<Steady, Refusal> fitWindow(const Seen& seen, Window window) {
  if (auto bad = tooSparse(seen, window.trusted)) return *bad;
  const auto& stream = seen.stream;
  const std::size_t from = window.offered.begin;
  const SteadyRun run = steadyRun(stream.timesOf(window.offered), stream.along(seen.direction, window.offered),
                                  {window.trusted.begin - from, window.trusted.end - from}, seen.noise);
  const Run used{from + run.run.begin, from + run.run.end};
  if (auto bad = tooSparse(seen, used)) return *bad;
  const Steady steady = lineOf(seen, run, from);
  if (steady.line.n < kLeastOfWindow) return *tooSparse(seen, {used.begin, used.begin + steady.line.n});
  const double change = speedChange(stream.timesOf(used), stream.along(seen.direction, used), seen.noise,
                                    kBendOfSteps * seen.steps.maxCoeff());
  if (change > 0.02) {
    return aboutTouch(seen.touch, "speed-not-constant",
                      "the " + seen.name + " speed changes by " + text(100.0 * change) +
                          " % during the retract, 2 % are allowed; retract at constant feed, "
                          "with the override locked");
  }
  if (auto bad = tooRough(seen, steady)) return *bad;
  return steady;
}

}  // namespace probebox::metrology
