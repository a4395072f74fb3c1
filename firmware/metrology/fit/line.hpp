#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

namespace probebox::metrology {

using Rows3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

// Straight line through three channels on exact stamps, about the mean stamp: there mean and slope are uncorrelated,
// with covariances C/n and C/sxx, where C is the covariance of one sample.
struct Line {
  std::size_t n{};
  double t_mean{};          // s
  Eigen::Vector3d mean;     // unit of the channels
  Eigen::Vector3d slope;    // that unit per second
  double sxx{};             // sum (t - t_mean)^2, s^2
  Eigen::Matrix3d scatter;  // sum of the outer products of the residuals; n - 2 degrees of freedom

  Eigen::Vector3d at(double t) const { return mean + slope * (t - t_mean); }
  // Sum of squared residuals along a unit direction.
  double scatterAlong(const Eigen::Vector3d& direction) const { return direction.dot(scatter * direction); }
};

// times: s, at least two different ones. values: one row a stamp.
Line fitLine(std::span<const double> times, const Eigen::Ref<const Rows3>& values);

// How large a share of the samples may lie in ramps: two fifths, or three.
enum class Trim { light, heavy };

// Robust standard deviation of one sample against its neighbours: blind to slopes. 0 for fewer than three samples.
double localDeviation(std::span<const double> times, std::span<const double> values, Trim trim);

// The same about zero, of a signal that rests there for two fifths of its samples.
double deviationAboutZero(std::span<const double> values);

// A run of samples, [begin, end).
struct Run {
  std::size_t begin{};
  std::size_t end{};
  std::size_t size() const { return end - begin; }
};

// Samples that lie on one straight line.
struct SteadyRun {
  Run run;
  std::vector<std::size_t> spikes;  // samples within the run, each alone among good ones, that do not
};

// The longest run about the middle of `trusted` that lies on one straight line with it: what remains when ramps at
// either end are cut away. A sample belongs to a ramp when it and the next one are more than four deviations off a
// robust line through the trusted ones; one that is off alone, by five, is a spike. Next to a cut as many samples more
// are left out as a ramp of constant acceleration may hide in the noise. trusted: at least three fifths of it free of
// ramps. noise: least deviation of one sample to reckon with.
SteadyRun steadyRun(std::span<const double> times, std::span<const double> values, Run trusted, double noise);

// Step of the encoder or converter of which all values are multiples; 0 when there is none.
double resolutionOf(std::span<const double> values);

}  // namespace probebox::metrology
