#pragma once
#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <vector>

namespace probebox::metrology {

// Decaying oscillation of the stylus since its contact, mm along the drive (CN101622513, docs/metrology.md A.3b).
struct Bounce {
  double frequency_hz{};
  double decay_per_s{};
  double sine_mm{};
  double cosine_mm{};
  bool off_surface{};  // the ball leaves the surface and falls back: the magnitude of the oscillation

  double at(double since_s) const;
  double amplitude() const { return std::hypot(sine_mm, cosine_mm); }
  // Derivatives of at() by sine, cosine, frequency and decay.
  Eigen::Vector4d columns(double since_s) const;
};

inline constexpr double kLowestBounce_hz = 20.0;
inline constexpr double kHighestBounce_hz = 500.0;

// What a bounce has to explain: residuals of the probe in their sd, and what else may explain them.
struct Unexplained {
  std::vector<double> ages_s;  // since the contact
  Eigen::VectorXd per_mm;      // of a residual by deflection
  Eigen::VectorXd residuals;   // measured less fitted
  Eigen::MatrixXd others;      // derivatives by the other unknowns
  double most_mm{};            // largest amplitude that can be
  double highest_hz{};         // that the samples tell
};

class BounceSearch {
 public:
  explicit BounceSearch(Unexplained record);

  // Takes the amplitudes that fit best at the bounce's frequency and decay. Returns what they take off chi-square; 0
  // for a bounce that cannot be.
  double fit(Bounce& bounce) const;
  // The best of many frequencies and decays, if it takes more than `least` off chi-square.
  std::optional<Bounce> best(double& least) const;

 private:
  // The same, with the shapes of sine and cosine, a row a sample in sd of its residual.
  double fit(Bounce& bounce, const Eigen::MatrixXd& shape) const;

  Unexplained record_;
  Eigen::MatrixXd basis_;  // orthonormal, of what the other unknowns explain
  Eigen::VectorXd left_;   // of the residuals, by the other unknowns
};

}  // namespace probebox::metrology
