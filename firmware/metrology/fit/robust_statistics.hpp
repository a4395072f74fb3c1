#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

namespace probebox::metrology {

// Largest distance of samples, in periods, across which values are interpolated.
inline constexpr double kGapPeriods = 2.5;

// One signal on its own increasing stamps, s.
struct Signal {
  std::vector<double> times;
  std::vector<double> values;

  double period() const;  // median interval of the stamps, s; 0 for fewer than two
};

// Stride that reduces `size` samples to some thousand, which are enough for a mean or median.
std::size_t strideOf(std::size_t size);

// Median of a non-empty list. Reorders it.
double median(std::vector<double>& values);

// Interpolation between samples: linear, or cubic through four of them (Lagrange).
enum class Interpolation { linear = 2, cubic = 4 };

// Estimates the variance of one sample from its deviation from the interpolation of its neighbours. Insensitive to
// slopes, the cubic also to curvature, and to a few kinks and spikes, the line to more of them. Uses some thousand
// samples of a long signal.
double sampleVariance(const Signal& signal, Interpolation interpolation);

// The smaller of the linear and cubic estimates: lines mistake curvature for noise, cubics kinks.
double smallerVariance(const Signal& signal);

// Linear interpolation at t; constant beyond the ends. cursor: end of the last search.
double between(const std::vector<double>& times, const std::vector<double>& values, double t, std::size_t& cursor);

// Moving average over 2 half + 1 values; fewer at the ends.
Eigen::VectorXd boxed(const Eigen::VectorXd& values, Eigen::Index half);

// Interpolates a signal between its stamps. Prepared once, so evaluation is cheap.
class Interpolant {
 public:
  struct Sample {
    double value{};
    double rate{};
  };
  Interpolant(const Signal& signal, Interpolation interpolation);

  // cursor: end of the last search; increasing times are fastest. The last piece is extrapolated beyond the ends.
  Sample at(double t, std::size_t& cursor) const;

  // Adds weight times the value at t to a sum, as gains of the individual samples (one per sample).
  void addGains(double t, double weight, std::size_t& cursor, Eigen::VectorXd& gains) const;
  // Variance of the value at t for samples of unit variance.
  double varianceAt(double t, std::size_t& cursor) const;

 private:
  // Polynomial between two stamps, in the time since the first.
  struct Piece {
    double from{};
    std::array<double, 4> powers{};
  };
  // Samples used by a piece, and their weights at t.
  struct Stencil {
    std::size_t first{};
    std::size_t count{};
    std::array<double, 4> weights{};
  };
  void advance(double t, std::size_t& cursor) const;
  Stencil stencilAt(double t, std::size_t& cursor) const;
  Piece pieceAt(const Signal& signal, std::size_t interval) const;
  bool isWide(std::size_t interval) const;

  const std::vector<double>* times_;
  Interpolation interpolation_;
  double gap_;  // s: intervals wider than this are interpolated linearly
  std::vector<Piece> pieces_;
};

}  // namespace probebox::metrology
