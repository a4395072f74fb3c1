#include "firmware/metrology/touch/ball_centre.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <utility>

#include "firmware/metrology/fit/noise_check.hpp"
#include "firmware/metrology/fit/sphere.hpp"
#include "firmware/metrology/touch/dwell_ringing.hpp"
#include "firmware/metrology/touch/retract.hpp"
#include "firmware/metrology/touch/touch.hpp"
#include "firmware/metrology/touch/touch_fit.hpp"

namespace probebox::metrology {
namespace {

struct Usable {
  std::vector<Retract> retracts;
  std::vector<std::size_t> reading;  // one a retract
  std::vector<std::size_t> row;      // of its touch
  std::vector<Dropped> dropped;
  std::vector<Refusal> refusals;

  void drop(const std::string& touch, const Refusal& why) {
    for (std::size_t i = 0; i < retracts.size(); ++i) {
      if (retracts[i].plan.name != touch) continue;
      retracts.erase(retracts.begin() + static_cast<std::ptrdiff_t>(i));
      reading.erase(reading.begin() + static_cast<std::ptrdiff_t>(i));
      row.erase(row.begin() + static_cast<std::ptrdiff_t>(i));
      break;
    }
    dropped.push_back({touch, why.name});
    refusals.push_back(why);
  }
};

Usable usable(const std::vector<Touch>& touches, const std::vector<std::size_t>& reading_of_touch) {
  Usable all;
  const StampJitter jitter = stampJitter(touches);
  for (std::size_t i = 0; i < touches.size(); ++i) {
    if (auto retract = fitRetract(touches[i], jitter)) {
      all.retracts.push_back(std::move(*retract));
      all.reading.push_back(reading_of_touch[i]);
      all.row.push_back(i);
    } else {
      all.dropped.push_back({touches[i].plan.name, retract.error().name});
      all.refusals.push_back(retract.error());
    }
  }
  for (const auto& noisy : noisyTouches(all.retracts)) {
    all.drop(noisy.name, {"residual-too-large", noisy.name + ": " + noisy.reason});
  }
  return all;
}

// Variance of the point at t along the line's motion.
double varianceAt(const Line& line, double t, const SampleNoise& noise) {
  const double lever = t - line.t_mean;
  return noise.along * (noise.of_mean / static_cast<double>(line.n) + noise.of_slope * lever * lever / line.sxx);
}

// Variance of a separation point along the motion (A8).
double pointVariance(const Retract& retract, const TouchNoise& noise) {
  const double t0 = separationTime(retract.probe);
  const double speed_per_slope = retract.machine.slope.norm() / retract.probe.slope.norm();
  const Eigen::Vector3d u = retract.machine.slope.normalized();
  return varianceAt(retract.machine, t0, noise.machine) +
         u.cwiseAbs2().dot(noise.rounded.at(t0 - retract.machine.t_mean)) +
         speed_per_slope * speed_per_slope * varianceAt(retract.probe, t0, noise.probe);
}

Eigen::Vector3d pointOf(const Retract& retract, const Eigen::Vector3d& tau) {
  return separationPoint(retract.machine, retract.probe) + tau.cwiseProduct(retract.machine.slope);
}

struct Reading {
  BallCentre ball;
  double sum_of_squares{};
  std::size_t dof{};
};

// Touches of a lathe of X and Z are in one plane across Y, and meet a circle of the ball there: its middle is that of
// the ball in X and Z, and Y is where all of them were.
Outcome<Fit, Refusal> fitInPlane(const Rows3& points, double sigma) {
  constexpr Eigen::Index kAlong = 1;
  if (points.rows() < 3)
    return Refusal{"too-few-readings", std::to_string(points.rows()) +
                                           " points where a circle needs 3: touch more (+x, -x and +z are usual)"};
  Eigen::MatrixXd flat{points.rows(), 2};
  flat << points.col(0), points.col(2);
  const auto start = algebraicBall(flat);
  if (!start) return Refusal{"coplanar", "no circle passes near the points: touch the ball from more sides"};
  Eigen::VectorXd at{3};
  at << start->centre, start->radius;
  TRY(auto fit, leastSquares(
                    [&](const Eigen::VectorXd& circle) {
                      Linearised model{Eigen::VectorXd{flat.rows()}, Eigen::MatrixXd{flat.rows(), 3}};
                      for (Eigen::Index i = 0; i < flat.rows(); ++i) {
                        const Eigen::RowVector2d arm = flat.row(i) - circle.head<2>().transpose();
                        model.residuals[i] = (arm.norm() - circle[2]) / sigma;
                        model.jacobian.row(i) << -arm.normalized() / sigma, -1.0 / sigma;
                      }
                      return model;
                    },
                    at));
  // The parameters are those of a sphere, X Y Z and the radius, with nothing unknown of Y.
  Fit whole = fit;
  whole.parameters =
      Eigen::Vector4d{fit.parameters[0], points.col(kAlong).mean(), fit.parameters[1], fit.parameters[2]};
  whole.cofactor = Eigen::MatrixXd::Zero(4, 4);
  constexpr std::array<Eigen::Index, 3> kPlaces{0, 2, 3};
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index k = 0; k < 3; ++k)
      whole.cofactor(kPlaces[static_cast<std::size_t>(i)], kPlaces[static_cast<std::size_t>(k)]) = fit.cofactor(i, k);
  }
  return whole;
}

Outcome<Reading, Refusal> fitReading(const Usable& touches, const PooledNoise& noise, std::size_t reading,
                                     const Eigen::Vector3d& tau, Plane plane) {
  std::vector<Eigen::Vector3d> points;
  double variance = 0.0;
  for (std::size_t i = 0; i < touches.retracts.size(); ++i) {
    if (touches.reading[i] != reading) continue;
    const Retract& retract = touches.retracts[i];
    points.push_back(pointOf(retract, tau));
    variance += pointVariance(retract, noise.of_touch[i]);
  }
  Rows3 rows{static_cast<Eigen::Index>(points.size()), 3};
  for (std::size_t i = 0; i < points.size(); ++i) rows.row(static_cast<Eigen::Index>(i)) = points[i].transpose();
  const double sigma = std::sqrt(variance / static_cast<double>(std::max<std::size_t>(points.size(), 1)));
  TRY(const auto fit, plane == Plane::xz ? fitInPlane(rows, sigma) : fitSphere(rows, {.sigma = sigma}));
  return Reading{{.centre_mm = fit.parameters.head<3>(),
                  .sd_mm = fit.cofactor.diagonal().head<3>().cwiseSqrt(),
                  .radius_mm = fit.parameters[3]},
                 fit.sumOfSquares(),
                 fit.dof};
}

// The remedy stands in the words about the touch that spoilt the reading, where there is one.
Refusal about(std::size_t reading, const Refusal& refusal, const Usable& touches) {
  std::string reason = "reading " + std::to_string(reading + 1) + ": " + refusal.reason;
  if (!touches.refusals.empty()) reason += " (" + touches.refusals.front().reason + ")";
  return {refusal.name, reason};
}

}  // namespace

Outcome<BallCentres, Refusal> ballCentres(const Dataset& dataset, const std::vector<std::size_t>& reading_of_touch,
                                          const std::array<double, 3>& tau_s, Plane plane) {
  TRY(const auto touches, readTouches(dataset));
  if (reading_of_touch.size() != touches.size())
    return Refusal{"ragged-table", "every touch needs the number of its reading"};
  const Usable all = usable(withoutRinging(touches), reading_of_touch);
  if (all.retracts.empty()) return all.refusals.front();
  if (auto refusal = tooFewResiduals(all.retracts)) return *refusal;
  const PooledNoise noise = poolNoise(all.retracts);
  const Eigen::Vector3d tau{tau_s[0], tau_s[1], tau_s[2]};
  BallCentres centres{.readings = {}, .alone = {}, .chi2_reduced = 0, .dof = 0, .dropped = all.dropped};
  double sum_of_squares = 0.0;
  for (std::size_t i = 0; i < all.retracts.size(); ++i) {
    if (all.reading[i] != kAlone) continue;
    const double sd_mm = std::sqrt(pointVariance(all.retracts[i], noise.of_touch[i]));
    centres.alone.push_back({.touch = all.row[i],
                             .at_mm = pointOf(all.retracts[i], tau),
                             .sd_mm = sd_mm,
                             .velocity_mm_s = all.retracts[i].machine.slope});
  }
  // kAlone is one less than none.
  std::size_t count = 0;
  for (const auto reading : reading_of_touch) count = std::max(count, reading + 1);
  for (std::size_t reading = 0; reading < count; ++reading) {
    const auto fitted = fitReading(all, noise, reading, tau, plane);
    if (!fitted) return about(reading, fitted.error(), all);
    centres.readings.push_back(fitted->ball);
    sum_of_squares += fitted->sum_of_squares;
    centres.dof += fitted->dof;
  }
  if (centres.dof == 0) return centres;
  const auto dof = static_cast<double>(centres.dof);
  centres.chi2_reduced = sum_of_squares / dof;
  const ChiSquareLaw law{.dof = centres.dof, .noise_dof = noise.least_dof};
  const double wider = checkNoise(centres.chi2_reduced, law, {}).widening;
  for (auto& ball : centres.readings) ball.sd_mm *= wider;
  for (auto& touch : centres.alone) touch.sd_mm *= wider;
  return centres;
}

}  // namespace probebox::metrology
