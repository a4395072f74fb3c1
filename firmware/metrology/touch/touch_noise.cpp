#include "firmware/metrology/touch/touch_noise.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"
#include "firmware/metrology/touch/sample_correlation.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

// Deviation that noise is never taken to be below, mm and raw: digits of a case file.
constexpr double kMostOfSteps = 0.5;  // steps^2

constexpr std::size_t kLeastResiduals = 6;  // of a stream: below, its noise is anyone's guess

struct Scatter {
  double along{};
  double across{};
  double dof{};  // along; twice as many across

  Scatter& operator+=(const Scatter& other) {
    along += other.along;
    across += other.across;
    dof += other.dof;
    return *this;
  }
  SampleNoise variance() const {
    return {std::max(along, 0.0) / dof + kCaseDigits * kCaseDigits, across / (2.0 * dof) + kCaseDigits * kCaseDigits};
  }
  // How much wider than a normal variate's the distribution is that so few residuals leave (JCGM 101, 6.4.9.4:
  // Student's).
  double spread() const { return dof > 3.0 ? dof / (dof - 2.0) : 3.0; }
};

// rounded: variance of the residuals along the motion that is no noise of single samples.
Scatter scatterOf(const Line& line, double rounded = 0.0) {
  const double along = line.scatterAlong(line.slope.normalized());
  const double dof = static_cast<double>(line.n) - 2.0;
  return {along - rounded * dof, line.scatter.trace() - along, dof};
}

bool sameSpeed(const Retract& a, const Retract& b) {
  return std::abs(a.plan.speed_mm_s - b.plan.speed_mm_s) < 0.02 * std::max(a.plan.speed_mm_s, b.plan.speed_mm_s);
}

// variance = still + jitter * speed^2: a jitter of the stamps shows as noise along the motion, in proportion to the
// speed.
struct NoiseLaw {
  double still{};
  double jitter{};  // s^2
  double across{};
  double dof{};

  SampleNoise at(double speed) const { return {still + jitter * speed * speed, across}; }
};

// Rate of change of the stream, mm/s or raw/s.
double rateOf(const Line& line) {
  return line.slope.norm();
}

// Contribution of rounding to the residuals of each touch along its motion, and to its line.
struct Rounded {
  std::vector<double> residuals;
  std::vector<LineNoise> lines;
};

Rounded roundedOf(std::span<const Retract> retracts, Line Retract::*member, QuantisationError Retract::*rounding) {
  std::vector<Line> lines;
  std::vector<QuantisationError> roundings;
  for (const auto& touch : retracts) {
    lines.push_back(touch.*member);
    roundings.push_back(touch.*rounding);
  }
  const double noise = noiseBeforeRounding(lines, roundings);
  Rounded rounded;
  for (const auto& touch : retracts) {
    const Eigen::Vector3d u = (touch.*member).slope.normalized();
    double residual = 0.0;
    LineNoise line;
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      const QuantisationError::Share share = (touch.*rounding).shareOf(axis, noise);
      line.mean[axis] = share.mean;
      line.slope[axis] = share.slope;
      line.both[axis] = share.both;
      residual += u[axis] * u[axis] * share.residual;
    }
    rounded.residuals.push_back(residual);
    rounded.lines.push_back(line);
  }
  return rounded;
}

// Line through the squared residuals of the touches against the square of their rates, weighted by what a sum of
// squares is uncertain by. The jitter counts only where it stands out by three deviations.
NoiseLaw noiseLaw(std::span<const Retract> retracts, Line Retract::*member, std::span<const double> rounded) {
  Scatter all;
  for (std::size_t k = 0; k < retracts.size(); ++k) all += scatterOf(retracts[k].*member, rounded[k]);
  NoiseLaw law{
      .still = all.variance().along * all.spread(), .jitter = 0.0, .across = all.variance().across, .dof = all.dof};
  NoiseLaw tried = law;
  for (int round = 0; round < 5; ++round) {
    Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
    Eigen::Vector2d right = Eigen::Vector2d::Zero();
    for (std::size_t k = 0; k < retracts.size(); ++k) {
      const Line& line = retracts[k].*member;
      const Scatter own = scatterOf(line, rounded[k]);
      const double rate = rateOf(line);
      const Eigen::Vector2d row{1.0, rate * rate};
      const double weight = own.dof / (2.0 * std::pow(tried.at(rate).along, 2));
      normal += weight * row * row.transpose();
      right += weight * row * own.along / own.dof;
    }
    const Eigen::Matrix2d covariance = inverse(normal);
    const Eigen::Vector2d solution = covariance * right;
    if (!(solution[1] > 3.0 * std::sqrt(covariance(1, 1)))) return law;
    tried.still = std::max(solution[0] * all.spread(), kCaseDigits * kCaseDigits);
    tried.jitter = solution[1] * all.spread();
  }
  return tried;
}

// Of the samples that quantisation does not dominate.
SampleCorrelation correlationOf(std::span<const Retract> retracts, Line Retract::*member,
                                Eigen::Matrix3d Retract::*neighbours) {
  std::vector<LineResiduals> lines;
  for (const auto& touch : retracts) {
    const Line& line = touch.*member;
    const Scatter own = scatterOf(line);
    const QuantisationError& rounding = member == &Retract::machine ? touch.rounding : touch.probe_rounding;
    const double of_steps = std::pow(rounding.coarsest(), 2) * own.dof;
    if (own.along < of_steps || own.dof < 1.0) continue;
    lines.push_back({line.n, own.along, own.across, (touch.*neighbours).trace()});
  }
  return sampleCorrelation(lines);
}

void correlate(SampleNoise& noise, const SampleCorrelation& correlation, const Line& line) {
  if (correlation.r == 0.0) return;
  const CorrelatedLine factors = correlatedLine(line.n, correlation.r);
  noise.along *= correlation.of_variance;
  noise.across *= correlation.of_variance;
  noise.of_mean = factors.mean;
  noise.of_slope = factors.slope;
}

// Samples that are rounded alike shift their line, which hardly shows in its residuals: a variance of its own.
void roundAlike(SampleNoise& noise, const LineNoise& rounded, const Line& line) {
  const Eigen::Vector3d squares = line.slope.normalized().cwiseAbs2();
  const double mean = squares.dot(rounded.mean), slope = squares.dot(rounded.slope);
  if (!(mean > 0.0)) return;
  noise.along = std::max(noise.along, kCaseDigits * kCaseDigits);
  noise.of_mean += static_cast<double>(line.n) * mean / noise.along;
  noise.of_slope += line.sxx * slope / noise.along;
}

// Median over the touches of that speed, so that a bad touch does not hide in a pool which it has spoilt.
double usualVariance(std::span<const Retract> retracts, const Retract& touch, Line Retract::*line) {
  std::vector<double> at_speed;
  std::vector<double> of_all;
  for (const auto& other : retracts) {
    const double variance = scatterOf(other.*line).variance().along;
    of_all.push_back(variance);
    if (sameSpeed(touch, other)) at_speed.push_back(variance);
  }
  auto& variances = at_speed.size() >= 4 ? at_speed : of_all;
  return median(variances);
}

}  // namespace

PooledNoise poolNoise(std::span<const Retract> retracts, Neighbours neighbours) {
  const Rounded rounded = roundedOf(retracts, &Retract::machine, &Retract::rounding);
  const Rounded rounded_probe = roundedOf(retracts, &Retract::probe, &Retract::probe_rounding);
  const NoiseLaw machine = noiseLaw(retracts, &Retract::machine, rounded.residuals);
  const NoiseLaw probe = noiseLaw(retracts, &Retract::probe, std::vector<double>(retracts.size()));
  const bool recorded = neighbours == Neighbours::recorded;
  const SampleCorrelation of_machine =
      recorded ? correlationOf(retracts, &Retract::machine, &Retract::machine_neighbours) : SampleCorrelation{};
  const SampleCorrelation of_probe = correlationOf(retracts, &Retract::probe, &Retract::probe_neighbours);
  PooledNoise noise;
  if (of_machine.is_clear) noise.warnings.push_back(correlatedSamples("machine", of_machine.r));
  if (of_probe.is_clear) noise.warnings.push_back(correlatedSamples("probe", of_probe.r));
  noise.dof = static_cast<std::size_t>(machine.dof + probe.dof);
  noise.least_dof = static_cast<std::size_t>(std::min(machine.dof, probe.dof));
  for (std::size_t k = 0; k < retracts.size(); ++k) {
    noise.of_touch.push_back(
        {machine.at(rateOf(retracts[k].machine)), probe.at(rateOf(retracts[k].probe)), rounded.lines[k]});
    correlate(noise.of_touch[k].machine, of_machine, retracts[k].machine);
    correlate(noise.of_touch[k].probe, of_probe, retracts[k].probe);
    roundAlike(noise.of_touch[k].probe, rounded_probe.lines[k], retracts[k].probe);
  }
  return noise;
}

std::optional<Refusal> tooFewResiduals(std::span<const Retract> retracts) {
  for (const auto& [line, stream] : {std::pair{&Retract::machine, "machine"}, std::pair{&Retract::probe, "probe"}}) {
    std::size_t samples = 0;
    std::size_t residuals = 0;
    for (const auto& touch : retracts) {
      samples += (touch.*line).n;
      residuals += (touch.*line).n - 2;
    }
    if (residuals >= kLeastResiduals) continue;
    return Refusal{"too-few-samples",
                   std::to_string(samples) + " " + stream + " samples at constant speed in " +
                       std::to_string(retracts.size()) +
                       " touches do not determine their noise; retract more slowly or further, or sample faster"};
  }
  return std::nullopt;
}

std::vector<Dropped> noisyTouches(std::span<const Retract> retracts) {
  std::vector<Dropped> noisy;
  for (const auto& touch : retracts) {
    for (const auto& [line, stream] : {std::pair{&Retract::machine, "machine"}, std::pair{&Retract::probe, "probe"}}) {
      const Scatter own = scatterOf(touch.*line);
      // Of few residuals the squares are larger by chance, and so few tell no slip.
      const double usual = 9.0 * (1.0 + 12.0 / own.dof) * usualVariance(retracts, touch, line);
      // Samples that are rounded alike have next to no residuals, up to where half of them are rounded otherwise.
      const QuantisationError& rounding = line == &Retract::machine ? touch.rounding : touch.probe_rounding;
      const double of_steps = kMostOfSteps * std::pow(rounding.coarsest(), 2);
      if (own.dof < 2.5 || own.variance().along <= std::max(usual, of_steps)) continue;
      noisy.push_back({touch.plan.name, std::string{"residual-too-large: the "} + stream +
                                            " samples lie more than 3 sigma about their line (slip or bounce)"});
      break;
    }
  }
  return noisy;
}

}  // namespace probebox::metrology
