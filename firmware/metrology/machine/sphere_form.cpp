#include "firmware/metrology/machine/sphere_form.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/chi_square.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr Index kFewestDirections = 15;
constexpr double kWidestGap = 0.9;  // rad about the stylus; four lobes have a maximum or minimum every 0.8 rad
constexpr double kAcross = 0.5;     // sine of the angle to the stylus of a touch that tells lobes
constexpr double kEquator = 0.1;    // component along the stylus of a touch across it
constexpr double kWorstCondition = 300.0;
constexpr double kOtherForm = 1e-3;  // probability that noise leaves so much of the lobes
constexpr int kDraws = 400;          // for the sd of a range
constexpr Index kMoreReadings = 4;   // than unknowns, of a range

// Cosine and sine of lobes about the stylus, and the part across it, as the lobes of a stylus grow with the angle to
// it.
Eigen::RowVector<double, kLobes> lobesAt(const Vector3d& n) {
  const double across = std::hypot(n.x(), n.y()), around = std::atan2(n.y(), n.x());
  Eigen::RowVector<double, kLobes> lobes;
  for (Index k = 0; k < 3; ++k) {
    lobes[2 * k] = across * std::cos(static_cast<double>(k + 2) * around);
    lobes[2 * k + 1] = across * std::sin(static_cast<double>(k + 2) * around);
  }
  lobes[6] = across;
  return lobes;
}

// Range of what touches miss the sphere, or the circle, by that is fitted to them with equal weights.
class Range {
 public:
  explicit Range(MatrixXd rows) : rows_{std::move(rows)}, basis_{orthonormalColumns(rows_)} {}
  double of(const VectorXd& places) const {
    const VectorXd left = places - basis_ * (basis_.transpose() * places);
    return left.maxCoeff() - left.minCoeff();
  }

 private:
  MatrixXd rows_;
  MatrixXd basis_;
};

// The same normal deviates with every standard library, whose normal_distribution is its own (Box and Muller, Ann.
// Math. Statist. 29 (1958) 610).
class NormalDraws {
 public:
  double operator()() {
    const double radius = std::sqrt(-2 * std::log(1 - uniform()));
    return radius * std::cos(kTurn * uniform());
  }

 private:
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }  // from 0 to below 1

  std::mt19937_64 random_{1};
};

}  // namespace

std::optional<Refusal> refuseDirections(std::span<const Vector3d> directions) {
  if (std::ssize(directions) < kFewestDirections) {
    return Refusal{"few-directions", "the sphere is touched from " + std::to_string(directions.size()) +
                                         " directions: its form takes at least " + std::to_string(kFewestDirections) +
                                         ", best the 25 of ISO 10360-5 and the axes"};
  }
  std::vector<double> around;
  for (const auto& n : directions)
    if (std::hypot(n.x(), n.y()) > kAcross) around.push_back(std::atan2(n.y(), n.x()));
  std::ranges::sort(around);
  double widest = around.empty() ? kTurn : around.front() + kTurn - around.back();
  for (std::size_t i = 1; i < around.size(); ++i) widest = std::max(widest, around[i] - around[i - 1]);
  if (widest <= kWidestGap) return std::nullopt;
  return Refusal{"few-directions", "no touch across the stylus for " + text(degrees(widest)) +
                                       " degrees around it: touch the sphere every 45 degrees or closer"};
}

Outcome<SphereForm, Refusal> fitSphereForm(std::span<const Vector3d> directions, const VectorXd& places_mm,
                                           const MatrixXd& covariance, std::size_t noise_dof) {
  const Index n = std::ssize(directions);
  MatrixXd rows{n, 4 + kLobes};
  for (Index d = 0; d < n; ++d) {
    const Vector3d& u = directions[static_cast<std::size_t>(d)];
    rows.row(d) << u.transpose(), 1, lobesAt(u);
  }
  const MatrixXd white = inverse(lowerCholesky(covariance));
  const auto fit = linearLeastSquares(white * rows, white * places_mm);
  if (!fit || fit->condition > kWorstCondition) {
    return Refusal{
        "few-directions",
        "the directions do not tell the form from the place of the sphere: touch it at four heights or more, "
        "and every 45 degrees around it"};
  }
  const double dof = static_cast<double>(n - rows.cols());
  const double reduced = fit->residuals.squaredNorm() / dof;
  SphereForm form;
  form.explained =
      ChiSquareLaw{.dof = static_cast<std::size_t>(dof), .noise_dof = noise_dof}.probabilityAbove(reduced) > kOtherForm;
  const VectorXd& at = fit->parameters;
  const VectorXd sd = (fit->cofactor.diagonal() * (form.explained ? 1.0 : reduced)).cwiseSqrt();
  form.centre_mm = at.head<3>();
  form.sd_centre_mm = sd.head<3>();
  form.radius_mm = at[3];
  form.sd_radius_mm = sd[3];
  form.lobes_mm = at.tail<kLobes>();
  form.sd_lobes_mm = sd.tail<kLobes>();
  form.by_lobes_mm = rows.rightCols(kLobes) * at.tail<kLobes>();
  form.found_mm = places_mm - rows.leftCols(4) * at.head<4>();
  form.sd_found_mm = covariance.diagonal().cwiseSqrt();
  return form;
}

std::optional<FormRange> formRange(std::span<const FormReading> readings, bool across) {
  std::vector<FormReading> used;
  for (const auto& one : readings)
    if (!across || std::abs(one.direction.z()) <= kEquator) used.push_back(one);
  const Index n = std::ssize(used), unknowns = across ? 3 : 4;
  if (n < unknowns + kMoreReadings) return std::nullopt;
  MatrixXd rows{n, unknowns};
  VectorXd read{n}, expected{n}, sd{n};
  for (Index row = 0; row < n; ++row) {
    const FormReading& one = used[static_cast<std::size_t>(row)];
    rows.row(row) << one.direction.head(unknowns - 1).transpose(), 1;
    read[row] = one.place_mm;
    expected[row] = one.expected_mm;
    sd[row] = one.sd_mm;
  }
  const Range range{rows};
  NormalDraws normal;
  double sum = 0, squares = 0;
  for (int draw = 0; draw < kDraws; ++draw) {
    VectorXd drawn = expected;
    for (Index k = 0; k < n; ++k) drawn[k] += sd[k] * normal();
    const double one = range.of(drawn);
    sum += one;
    squares += one * one;
  }
  const double mean = sum / kDraws;
  return FormRange{range.of(read), std::sqrt((squares / kDraws - mean * mean) * kDraws / (kDraws - 1))};
}

}  // namespace probebox::metrology
