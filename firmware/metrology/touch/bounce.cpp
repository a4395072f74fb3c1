#include "firmware/metrology/touch/bounce.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "firmware/metrology/fit/decompositions.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;

constexpr std::array kDecays{40.0, 110.0, 250.0, 600.0};  // 1/s, that are tried
constexpr double kDependent = 1e-9;                       // of a square: less is left of a shape that others explain

}  // namespace

Eigen::Vector4d Bounce::columns(double since_s) const {
  if (since_s <= 0.0) return Eigen::Vector4d::Zero();
  const double fade = std::exp(-decay_per_s * since_s);
  double sine = fade * std::sin(kTurn * frequency_hz * since_s);
  double cosine = fade * std::cos(kTurn * frequency_hz * since_s);
  if (off_surface && sine_mm * sine + cosine_mm * cosine < 0.0) sine = -sine, cosine = -cosine;
  return {sine, cosine, kTurn * since_s * (sine_mm * cosine - cosine_mm * sine),
          -since_s * (sine_mm * sine + cosine_mm * cosine)};
}

double Bounce::at(double since_s) const {
  return columns(since_s).head<2>().dot(Eigen::Vector2d{sine_mm, cosine_mm});
}

BounceSearch::BounceSearch(Unexplained record)
    : record_{std::move(record)},
      basis_{orthonormalColumns(record_.others)},
      left_{record_.residuals - basis_ * (basis_.transpose() * record_.residuals)} {}

double BounceSearch::fit(Bounce& bounce) const {
  MatrixXd shape{left_.size(), 2};
  for (Index i = 0; i < shape.rows(); ++i)
    shape.row(i) =
        record_.per_mm[i] * bounce.columns(record_.ages_s[static_cast<std::size_t>(i)]).head<2>().transpose();
  return fit(bounce, shape);
}

double BounceSearch::fit(Bounce& bounce, const MatrixXd& shape) const {
  // Beside what the other unknowns explain of it.
  const MatrixXd theirs = basis_.transpose().lazyProduct(shape);
  const auto product = [&](Index i, Index k) {
    return shape.col(i).dot(shape.col(k)) - theirs.col(i).dot(theirs.col(k));
  };
  const double s = shape.col(0).dot(left_), c = bounce.off_surface ? 0.0 : shape.col(1).dot(left_);
  const double ss = product(0, 0);
  if (!(ss > kDependent * shape.col(0).squaredNorm())) return 0.0;
  if (bounce.off_surface) {  // from the contact on
    bounce.sine_mm = s / ss;
    bounce.cosine_mm = 0.0;
  } else {
    const double sc = product(0, 1), cc = product(1, 1), determinant = ss * cc - sc * sc;
    if (!(determinant > kDependent * ss * shape.col(1).squaredNorm())) return 0.0;
    bounce.sine_mm = (cc * s - sc * c) / determinant;
    bounce.cosine_mm = (ss * c - sc * s) / determinant;
  }
  const bool possible = bounce.amplitude() < record_.most_mm && !(bounce.off_surface && bounce.sine_mm < 0.0);
  return possible ? bounce.sine_mm * s + bounce.cosine_mm * c : 0.0;
}

// What of a bounce depends on its decay alone is computed once, what depends on its frequency alone once for each.
std::optional<Bounce> BounceSearch::best(double& least) const {
  const Eigen::Map<const ArrayXd> ages{record_.ages_s.data(), left_.size()};
  const ArrayXd begun = (ages > 0.0).cast<double>() * record_.per_mm.array();
  std::array<ArrayXd, kDecays.size()> fades;
  for (std::size_t k = 0; k < kDecays.size(); ++k) fades[k] = begun * (-kDecays[k] * ages.max(0.0)).exp();
  std::optional<Bounce> found;
  MatrixXd shape{left_.size(), 2};
  for (double hertz = kLowestBounce_hz; hertz <= std::min(kHighestBounce_hz, record_.highest_hz); hertz *= 1.08) {
    const ArrayXd sine = (kTurn * hertz * ages).sin(), cosine = (kTurn * hertz * ages).cos();
    for (std::size_t k = 0; k < kDecays.size(); ++k) {
      for (const bool off_surface : {false, true}) {
        Bounce bounce{hertz, kDecays[k], 0.0, 0.0, off_surface};
        shape.col(0) = fades[k] * (off_surface ? sine.abs() : sine);
        shape.col(1) = fades[k] * cosine;
        const double gain = fit(bounce, shape);
        if (gain <= least) continue;
        least = gain;
        found = bounce;
      }
    }
  }
  return found;
}

}  // namespace probebox::metrology
