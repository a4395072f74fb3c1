#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace probebox::metrology {

using Rows3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

// Straight line through three channels on exact stamps, about the mean stamp, where mean and slope are uncorrelated
// with covariances C/n and C/sxx; C: covariance of one sample.
struct Line {
  std::size_t n{};
  double t_mean{};          // s
  Eigen::Vector3d mean;     // unit of the channels
  Eigen::Vector3d slope;    // that unit per second
  double sxx{};             // sum (t - t_mean)^2, s^2
  Eigen::Matrix3d scatter;  // sum of the outer products of the residuals; n - 2 degrees of freedom

  Eigen::Vector3d at(double t) const { return mean + slope * (t - t_mean); }
  // When it is at a place along a direction in which it moves.
  double timeAt(const Eigen::Vector3d& direction, double place) const {
    return t_mean + (place - mean.dot(direction)) / slope.dot(direction);
  }
  // Sum of squared residuals along a unit direction.
  double scatterAlong(const Eigen::Vector3d& direction) const { return direction.dot(scatter * direction); }
};

// times: s, at least two different ones. values: one row per stamp.
Line fitLine(std::span<const double> times, const Eigen::Ref<const Rows3>& values);

// Largest fraction of the samples in ramps: two fifths, or three fifths.
enum class Trim { light, heavy };

// Robust standard deviation of one sample relative to its neighbours, insensitive to slopes. 0 for fewer than three
// samples.
double localDeviation(std::span<const double> times, std::span<const double> values, Trim trim);

// The same about zero, for a signal that is at rest for two fifths of its samples.
double deviationAboutZero(std::span<const double> values);

// Index range of samples, [begin, end).
struct Run {
  std::size_t begin{};
  std::size_t end{};
  std::size_t size() const { return end - begin; }
};

// Samples that lie on one straight line.
struct SteadyRun {
  Run run;
  std::vector<std::size_t> spikes;  // isolated samples within the run that are off the line
};

// Finds the longest run around the middle of `trusted` on one straight line, without ramps at its ends. A sample
// belongs to a ramp when it and the next one are more than four sd off a robust line; a single sample five sd off is a
// spike. Next to a cut, samples that may hide a ramp below the noise are omitted too. trusted: at least three fifths
// without ramps. noise: smallest sd of one sample.
SteadyRun steadyRun(std::span<const double> times, std::span<const double> values, Run trusted, double noise);

// Resolution of the encoder or converter: the step of which all values are multiples; 0 if there is none.
double resolutionOf(std::span<const double> values);

}  // namespace probebox::metrology
