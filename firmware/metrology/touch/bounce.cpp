#include "firmware/metrology/touch/bounce.hpp"

#include <algorithm>
#include <utility>

#include "firmware/metrology/fit/decompositions.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kDependent = 1e-12;  // of sine and cosine, one of which says nothing beside the other

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
    : record_{std::move(record)}, basis_{orthonormalColumns(record_.others)}, left_{across(record_.residuals)} {}

MatrixXd BounceSearch::across(const MatrixXd& columns) const {
  return columns - basis_ * (basis_.transpose() * columns);
}

double BounceSearch::fit(Bounce& bounce) const {
  MatrixXd shape{left_.size(), 2};
  for (Index i = 0; i < shape.rows(); ++i)
    shape.row(i) =
        record_.per_mm[i] * bounce.columns(record_.ages_s[static_cast<std::size_t>(i)]).head<2>().transpose();
  // The ball leaves the surface from the contact on.
  if (bounce.off_surface) shape.col(1).setZero();
  shape = across(shape);
  const double ss = shape.col(0).squaredNorm(), sc = shape.col(0).dot(shape.col(1)), cc = shape.col(1).squaredNorm();
  const double s = shape.col(0).dot(left_), c = shape.col(1).dot(left_);
  const double determinant = ss * cc - sc * sc;
  if (bounce.off_surface) {
    bounce.sine_mm = ss > 0.0 ? s / ss : 0.0;
  } else if (determinant > kDependent * ss * cc) {
    bounce.sine_mm = (cc * s - sc * c) / determinant;
    bounce.cosine_mm = (ss * c - sc * s) / determinant;
  } else {
    return 0.0;
  }
  const bool possible = bounce.amplitude() < record_.most_mm && !(bounce.off_surface && bounce.sine_mm < 0.0);
  return possible ? bounce.sine_mm * s + bounce.cosine_mm * c : 0.0;
}

std::optional<Bounce> BounceSearch::best(double& least) const {
  std::optional<Bounce> found;
  for (double hertz = kLowestBounce_hz; hertz <= std::min(kHighestBounce_hz, record_.highest_hz); hertz *= 1.08) {
    for (const double decay : {40.0, 110.0, 250.0, 600.0}) {
      for (const bool off_surface : {false, true}) {
        // The sign of an oscillation of magnitude 1 tells where it is reflected.
        Bounce bounce{hertz, decay, off_surface ? 1.0 : 0.0, 0.0, off_surface};
        const double gain = fit(bounce);
        if (gain <= least) continue;
        least = gain;
        found = bounce;
      }
    }
  }
  return found;
}

}  // namespace probebox::metrology
