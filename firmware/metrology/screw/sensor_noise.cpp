#include "firmware/metrology/screw/sensor_noise.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "firmware/metrology/fit/chi_square.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;

constexpr Index kLeastBlocks = 15;   // simulated: with fewer, their scatter draws the time constant
constexpr double kLeastFree = 20.0;  // free sums of stretches

// Excess kurtosis, 0 of a Gaussian; large where few readings differ, as by steps of a converter.
double excessOf(const Eigen::VectorXd& residuals) {
  const double squares = residuals.squaredNorm();
  const double fourth = residuals.array().square().square().sum();
  return std::max(0.0, static_cast<double>(residuals.size()) * fourth / (squares * squares) - 3);
}

// Variance of the sum of a block against that of as many independent readings, for a correlation r^m at m readings.
double varianceOfSum(double length, double r) {
  return 1 + 2 * r / (1 - r) - 2 * r * (1 - std::pow(r, length)) / (length * (1 - r) * (1 - r));
}

}  // namespace

// By chi-square, once in some thousand times of independent readings.
bool SensorNoise::Blocks::isClear() const {
  const double free = count / (1 + excess / length / 2);
  return free >= 1 && ratio > rangeOf({.dof = static_cast<std::size_t>(free)}).high;
}

SensorNoise::Blocks SensorNoise::over(const std::vector<Index>& ends) const {
  const double squares = fit_.residuals.squaredNorm();
  if (!(squares > 0)) return {};
  Blocks blocks;
  double found = 0, independent = 0;
  Index from = 0;
  for (const Index end : ends) {
    const Index length = end - from;
    const Eigen::VectorXd fitted = design_.middleRows(from, length).colwise().sum().transpose();
    std::vector<Index> seen;  // few unknowns in a short block
    for (Index column = 0; column < fitted.size(); ++column)
      if (fitted[column] != 0) seen.push_back(column);
    const Eigen::VectorXd some = fitted(seen);
    const double left = static_cast<double>(length) - some.dot(fit_.cofactor(seen, seen) * some);
    found += std::pow(fit_.residuals.segment(from, length).sum(), 2);
    independent += left;
    blocks.count += left / static_cast<double>(length);
    from = end;
  }
  if (!(independent > 0)) return {};
  blocks.length = static_cast<double>(from) / static_cast<double>(ends.size());
  blocks.excess = excessOf(fit_.residuals);
  blocks.ratio = found / independent / (squares / static_cast<double>(fit_.dof));
  return blocks;
}

double SensorNoise::ofAll() const {
  const Index size = fit_.residuals.size();
  if (size < 2 * kLeastBlocks) return ofNeighbours();
  std::vector<Blocks> all;
  for (Index length = size / kLeastBlocks; length > 1; length /= 2) {
    std::vector<Index> ends;
    for (Index end = length; end <= size; end += length) ends.push_back(end);
    all.push_back(over(ends));
  }
  if (std::ranges::none_of(all, &Blocks::isClear)) return 1;
  // The share of the noise with a time constant by linear least squares at each of them.
  double least = std::numeric_limits<double>::infinity(), inflation = 1;
  for (double constant = 0.3; constant < all.front().length; constant *= 1.1) {
    const double r = std::exp(-1 / constant);
    double squares = 0, product = 0, misfit = 0;
    for (const auto& blocks : all) {
      const double weight = blocks.count / (blocks.ratio * blocks.ratio);
      const double shape = varianceOfSum(blocks.length, r) - 1;
      squares += weight * shape * shape;
      product += weight * shape * (blocks.ratio - 1);
    }
    const double share = std::clamp(product / squares, 0.0, 1.0);
    for (const auto& blocks : all) {
      const double off = blocks.ratio - 1 - share * (varianceOfSum(blocks.length, r) - 1);
      misfit += blocks.count * off * off / (blocks.ratio * blocks.ratio);
    }
    if (misfit >= least) continue;
    least = misfit;
    inflation = 1 + share * 2 * r / (1 - r);
  }
  return inflation;
}

double SensorNoise::ofStretches(const std::vector<Index>& ends, double of_all) const {
  const Blocks stretches = over(ends);
  if (stretches.count < kLeastFree) return of_all;
  return of_all > 1 || stretches.isClear() ? std::max(1.0, stretches.ratio) : 1;
}

// Of readings too few for blocks, which show no white noise beside the other.
double SensorNoise::ofNeighbours() const {
  const auto& residuals = fit_.residuals;
  const Index size = residuals.size();
  const double squares = residuals.squaredNorm();
  if (!(squares > 0)) return 1;
  const double r = residuals.head(size - 1).dot(residuals.tail(size - 1)) / squares;
  return r > 2 / std::sqrt(static_cast<double>(size)) ? (1 + r) / (1 - std::min(r, 0.999)) : 1;
}

void inflate(Result& result, std::string_view key, double inflation) {
  const double factor = std::sqrt(inflation);
  for (auto& estimate : result.estimates) {
    if (estimate.key != key) continue;
    for (double& sd : estimate.sd) sd *= factor;
  }
  if (!result.covariance) return;
  auto& [components, values] = *result.covariance;
  const std::size_t size = components.size();
  for (std::size_t k = 0; k < size; ++k) {
    if (components[k] != key && !components[k].starts_with(std::string{key} + "[")) continue;
    for (std::size_t other = 0; other < size; ++other) {
      values[k * size + other] *= factor;
      values[other * size + k] *= factor;
    }
  }
}

std::string correlatedWarning(const std::string& times) {
  return "neighbouring readings are correlated, as of a sensor with a time constant: the standard deviations are " +
         times + " times those of independent readings";
}

}  // namespace probebox::metrology
