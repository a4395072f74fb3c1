#pragma once
#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <vector>

namespace probebox::metrology {

// Samples further apart than this leave no value between them.
inline constexpr double kGapPeriods = 2.5;

// One signal on its own stamps. Stamps rise, s.
struct Signal {
  std::vector<double> times;
  std::vector<double> values;

  double period() const;  // median distance of the stamps, s; 0 for fewer than two
};

// Every which one of so many tells a mean or a median well enough: some thousand are looked at.
std::size_t strideOf(std::size_t size);

// Of values that are there. Reorders them.
double median(std::vector<double>& values);

// Samples of a signal between its stamps: by lines, or by cubics through four of them (Lagrange).
enum class Interpolation { linear = 2, cubic = 4 };

// Variance of one sample from what it misses the line or cubic through its neighbours by; blind to slopes, the cubic to
// bends too, and to a few kinks and spikes: the line to more of them. Of a long signal some thousand samples are looked
// at.
double sampleVariance(const Signal& signal, Interpolation interpolation);

// By lines or by cubics, whichever gives less: lines take a bend for noise, cubics a kink.
double smallerVariance(const Signal& signal);

// Value at t by a line between the samples beside it; the ends beyond them. cursor: where the last search ended.
double between(const std::vector<double>& times, const std::vector<double>& values, double t, std::size_t& cursor);

// Means over 2 half + 1 values about each; fewer at the ends.
Eigen::VectorXd boxed(const Eigen::VectorXd& values, Eigen::Index half);

// A signal between its stamps. Made once, so that asking it is cheap.
class Interpolant {
 public:
  struct Sample {
    double value{};
    double rate{};
  };
  Interpolant(const Signal& signal, Interpolation interpolation);

  // cursor: where the last search ended; times are best asked for in rising order. Beyond the ends the last piece goes
  // on.
  Sample at(double t, std::size_t& cursor) const;

  // Adds weight times the value at t to a sum over the signal's samples: what that sum gives of each of them.
  // gains: one a sample.
  void addGains(double t, double weight, std::size_t& cursor, Eigen::VectorXd& gains) const;
  // Variance of the value at t for samples of unit variance.
  double varianceAt(double t, std::size_t& cursor) const;

 private:
  // Between two stamps: the value as powers of the time since the first of them.
  struct Piece {
    double from{};
    std::array<double, 4> powers{};
  };
  // Samples that a piece goes through, and what each of them gives at t.
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
  double gap_;  // s: wider than this only a line leads across
  std::vector<Piece> pieces_;
};

}  // namespace probebox::metrology
