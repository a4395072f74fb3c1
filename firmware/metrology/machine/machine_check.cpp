#include "firmware/metrology/machine/machine_check.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/probe_pose.hpp"
#include "firmware/metrology/delay/delay_method.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"
#include "firmware/metrology/machine/check_run.hpp"
#include "firmware/metrology/machine/noise_line.hpp"
#include "firmware/metrology/machine/sphere_form.hpp"
#include "firmware/metrology/touch/size_line.hpp"
#include "firmware/metrology/touch/touch_design.hpp"
#include "firmware/metrology/touch/whole_record.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::RowVector3d;
using Eigen::RowVectorXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kGoodCondition = 300.0;
constexpr int kScatterRounds = 6;
constexpr double kContactShare = 0.1;  // of the deflection
// Where the probe has hysteresis, the bounce of the stylus goes through some of it and bends the way in (simulated).
constexpr double kBentByBounce = 0.2;    // of the hysteresis, over the square of the depth: of a bend
constexpr double kMovedByBounce = 0.02;  // of the hysteresis: of a lobe
constexpr double kGuard_s = 0.002;       // beside the contact
constexpr double kCalm_s = 0.02;         // of a rest, until what rings is over

// All touches together, (A25) to (A27): three rows each, distance, delay and bend.
class AllTouches {
  using Rows = Eigen::Matrix<double, 3, Eigen::Dynamic>;

 public:
  explicit AllTouches(const CheckRun& run) : run_{run} {
    double gain = 0;
    for (const auto& one : run.touches) gain += one.touch.values[2] / static_cast<double>(run.count());
    for (const auto& one : run.touches) {
      Rows rows{3, run.unknowns()};
      rows.setZero();
      rows(0, one.direction) = 1;
      rows.block<1, 3>(0, run.driftAt()) = one.minutes * one.normal.transpose();
      if (run.curved) rows.block<1, 3>(0, run.driftAt() + 3) = one.minutes * one.minutes * one.normal.transpose();
      const Vector3d u = one.touch.plan.retract;
      const double per_lost = -0.5 / one.speed_mm_s;
      const Index at = run.othersAt();
      rows.block<1, 3>(1, at) = u.cwiseAbs2().transpose();
      rows.block<1, 3>(1, at + kLostAt) = per_lost * u.cwiseAbs().transpose();
      rows(1, at + kHysteresisAt) = per_lost;
      rows.block<1, 3>(2, at + kBendAt) =
          one.touch.values[2] / gain *
          one.touch.channels.cwiseAbs().cwiseProduct(one.touch.channels.cwiseAbs2()).transpose();
      rows_.push_back(std::move(rows));
      values_.emplace_back(one.distance_mm, one.touch.tau_s(), one.touch.values[3]);
      if (one.touch.has_way_in) continue;
      // The way out alone tells a place that moves with the delay.
      Rows& alone = rows_.back();
      alone.row(0).segment(at, kBendAt) = -one.speed_mm_s * alone.row(1).segment(at, kBendAt);
      alone.row(1).setZero();
      values_.back()[0] -= one.speed_mm_s * one.touch.tau_s();
      values_.back()[1] = 0;
    }
  }

  std::optional<Refusal> fit() {
    for (int round = 0; round <= kScatterRounds; ++round) {
      if (auto refusal = solve()) return refusal;
      if (round < kScatterRounds) widen();
    }
    return std::nullopt;
  }

  const VectorXd& parameters() const { return fit_->parameters; }
  const MatrixXd& covariance() const { return fit_->cofactor; }
  double condition() const { return fit_->condition; }
  std::size_t dof() const {
    const auto alone = std::ranges::count_if(run_.touches, [](const auto& one) { return !one.touch.has_way_in; });
    return static_cast<std::size_t>(3 * run_.count() - alone - run_.unknowns());
  }
  // Measured less fitted.
  Vector3d off(Index i) const { return values_[at(i)] - rows_[at(i)] * fit_->parameters; }
  Matrix3d covarianceOf(Index i) const {
    Matrix3d covariance = run_.touches[at(i)].covariance();
    covariance.diagonal() += scatter_.cwiseQuotient(perWay(i));
    return covariance;
  }
  Matrix3d covarianceOfOff(Index i) const {
    return covarianceOf(i) - rows_[at(i)] * fit_->cofactor * rows_[at(i)].transpose();
  }
  // Rows of delay, for the design figures: what one way tells is uncertain by 1 mm.
  MatrixXd designRows() const {
    MatrixXd rows{run_.count(), kHysteresisAt + 1};
    for (Index i = 0; i < run_.count(); ++i)
      rows.row(i) = std::sqrt(2.0) * run_.touches[at(i)].speed_mm_s *
                    rows_[at(i)].block(1, run_.othersAt(), 1, kHysteresisAt + 1);
    return rows;
  }

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }

  std::optional<Refusal> solve() {
    MatrixXd design{3 * run_.count(), run_.unknowns()};
    VectorXd values{3 * run_.count()};
    for (Index i = 0; i < run_.count(); ++i) {
      const Matrix3d covariance = covarianceOf(i);
      const Vector3d sizes = covariance.diagonal().cwiseSqrt().cwiseInverse();
      const MatrixXd scaled = sizes.asDiagonal() * covariance * sizes.asDiagonal();
      const Matrix3d white = inverse(lowerCholesky(scaled)) * sizes.asDiagonal();
      design.middleRows(3 * i, 3) = white * rows_[at(i)];
      values.segment<3>(3 * i) = white * values_[at(i)];
    }
    auto fit = linearLeastSquares(design, values);
    if (!fit) return fit.error();
    fit_ = std::move(fit).value();
    return std::nullopt;
  }

  // By what the touches scatter more than the noise of their samples says: distances, way in against way out, and
  // bends. One for both speeds: of two touches of a direction nobody can tell which one is off.
  void widen() {
    Vector3d beyond = Vector3d::Zero(), per_variance = Vector3d::Zero();
    for (Index i = 0; i < run_.count(); ++i) {
      const Vector3d variance = covarianceOf(i).diagonal(), left = covarianceOfOff(i).diagonal();
      const Vector3d tells{1, run_.touches[at(i)].touch.has_way_in ? 1.0 : 0.0, 1};
      beyond += (off(i).cwiseAbs2() - left).cwiseQuotient(variance).cwiseProduct(tells);
      per_variance += left.cwiseQuotient(variance.cwiseAbs2()).cwiseQuotient(perWay(i)).cwiseProduct(tells);
    }
    for (Index k = 0; k < 3; ++k)
      if (per_variance[k] > 0) scatter_[k] = std::max(0.0, scatter_[k] + beyond[k] / per_variance[k]);
  }
  // Of the scatter in mm^2, from that of a distance, a delay and a bend.
  Vector3d perWay(Index i) const {
    const CheckTouch& one = run_.touches[at(i)];
    return {one.touch.has_way_in ? 1.0 : 0.5, one.speed_mm_s * one.speed_mm_s, 1};
  }

  const CheckRun& run_;
  std::vector<Rows> rows_;
  std::vector<Vector3d> values_;
  Vector3d scatter_ = Vector3d::Zero();  // variances beyond those of the samples' noise
  std::optional<Fit> fit_;
};

// Scatter of ways in and out, ISO 230-2: what they miss the place of their direction by, drift taken out.
struct Scatter {
  double in_mm{}, out_mm{};
  double dof_in{}, dof_out{};
  double correlation{};  // of both

  double sdIn() const { return in_mm / std::sqrt(2 * dof_in); }
  double sdOut() const { return out_mm / std::sqrt(2 * dof_out); }
};
Scatter scatterOf(const CheckRun& run, const AllTouches& fit) {
  Eigen::Vector2d squares = Eigen::Vector2d::Zero(), expected = squares, stated = squares, left_squares = squares,
                  count = squares;
  double product = 0;
  for (Index i = 0; i < run.count(); ++i) {
    const CheckTouch& one = run.touches[static_cast<std::size_t>(i)];
    const bool both = one.touch.has_way_in;
    const double speed = both ? one.speed_mm_s : 0;
    Eigen::Matrix<double, 2, 3> ways;
    ways << 1, -speed, 0, 1, speed, 0;
    const Eigen::Vector2d tells{both ? 1.0 : 0.0, 1};
    const Eigen::Vector2d off = tells.cwiseProduct(ways * fit.off(i));
    const Eigen::Vector2d variance = tells.cwiseProduct((ways * fit.covarianceOf(i) * ways.transpose()).diagonal());
    const Eigen::Vector2d left = tells.cwiseProduct((ways * fit.covarianceOfOff(i) * ways.transpose()).diagonal());
    squares += off.cwiseAbs2();
    product += off[0] * off[1];
    expected += left;
    stated += variance;
    left_squares += left.cwiseProduct(variance);
    count += tells;
  }
  const Eigen::Vector2d sd = squares.cwiseProduct(stated).cwiseQuotient(expected).cwiseQuotient(count).cwiseSqrt();
  // Of a sum of squares with unequal variances (Welch and Satterthwaite).
  const Eigen::Vector2d dof = expected.cwiseAbs2().cwiseQuotient(left_squares);
  return {sd[0], sd[1], dof[0], dof[1], product / std::sqrt(squares[0] * squares[1])};
}

// The places of the directions, about the first guess of the centre.
Outcome<SphereForm, Refusal> formOf(const CheckRun& run, const AllTouches& together) {
  const Index n = run.driftAt();
  auto form = fitSphereForm(run.directions, together.parameters().head(n), together.covariance().topLeftCorner(n, n),
                            together.dof());
  if (!form) return form;
  const double moved = kMovedByBounce * together.parameters()[run.othersAt() + kHysteresisAt];
  form->sd_lobes_mm = (form->sd_lobes_mm.array().square() + moved * moved).sqrt();
  form->centre_mm += run.about;
  return form;
}

// One touch a direction, the first one at the slowest speed.
std::vector<FormReading> readingsOfForm(const CheckRun& run, const AllTouches& together, const SphereForm& form) {
  std::map<Index, Index> chosen;
  for (Index i = 0; i < run.count(); ++i) {
    const CheckTouch& one = run.touches[static_cast<std::size_t>(i)];
    const auto [known, is_new] = chosen.try_emplace(one.direction, i);
    const double before = run.touches[static_cast<std::size_t>(known->second)].touch.plan.speed_mm_s;
    if (!is_new && one.touch.plan.speed_mm_s < before) known->second = i;
  }
  std::vector<FormReading> readings;
  for (const auto& [direction, i] : chosen) {
    readings.push_back({.direction = run.directions[static_cast<std::size_t>(direction)],
                        .place_mm = together.parameters()[direction] + together.off(i)[0],
                        .expected_mm = form.explained ? form.by_lobes_mm[direction] : form.found_mm[direction],
                        .sd_mm = std::sqrt(together.covarianceOf(i)(0, 0))});
  }
  return readings;
}

// Signals that ought to stand still, of each touch.
struct StillParts {
  std::vector<StillWindow> rest;     // positions
  std::vector<StillWindow> contact;  // deflections at rest, mm along the machine's axes
  std::vector<StillWindow> free;     // the same before the contact
  std::vector<StillWindow> after;    // and when the stylus has come to rest again
};

StillWindow windowOf(const Stream& stream, const Rows3& values, double from_s, double until_s) {
  const auto begin = std::ranges::lower_bound(stream.times, from_s) - stream.times.begin();
  const auto end = std::ranges::lower_bound(stream.times, until_s) - stream.times.begin();
  if (end <= begin) return {};
  return {{stream.times.begin() + begin, stream.times.begin() + end}, values.middleRows(begin, end - begin)};
}

Outcome<StillParts, Refusal> stillParts(const CheckRun& run) {
  MatrixXd slopes{run.count(), 3}, ways{run.count(), 3};
  for (Index i = 0; i < run.count(); ++i) {
    const WholeTouch& touch = run.touches[static_cast<std::size_t>(i)].touch;
    slopes.row(i) = touch.values[2] * touch.channels.transpose();
    ways.row(i) = touch.plan.retract.transpose();
  }
  const auto turned = solveFullRank(slopes, ways);  // (A3), row by row
  if (!turned) return Refusal{"few-directions", "the deflections lie in one plane: touch the top as well"};
  const double tau = [&] {
    std::vector<double> all;
    for (const auto& one : run.touches) all.push_back(one.touch.tau_s());
    return median(all);
  }();
  StillParts parts;
  for (const auto& one : run.touches) {
    const Stream& machine = run.recorded[one.recorded].machine;
    const Stream& probe = run.recorded[one.recorded].probe;
    const Rows3 bent = probe.values * *turned;
    const VectorXd along = bent * one.touch.plan.retract;
    const double level = kContactShare * along.maxCoeff(), slope_s = level / one.speed_mm_s + kGuard_s;
    Index first = 0, last = along.size() - 1;
    while (first < last && along[first] < level) ++first;
    while (last > first && along[last] < level) --last;
    const double leaves_s = probe.times[static_cast<std::size_t>(last)] + slope_s;
    parts.free.push_back(
        windowOf(probe, bent, probe.times.front(), probe.times[static_cast<std::size_t>(first)] - slope_s));
    parts.after.push_back(windowOf(probe, bent, 0.5 * (leaves_s + probe.times.back()), probe.times.back() + kGuard_s));
    const double from_s = one.touch.rest_from_s, until_s = one.touch.rest_until_s;
    if (until_s <= from_s) continue;
    parts.rest.push_back(windowOf(machine, machine.values, from_s, until_s));
    if (until_s - from_s > 2 * kCalm_s)
      parts.contact.push_back(windowOf(probe, bent, from_s + kCalm_s - tau, until_s - tau));
  }
  return parts;
}

// Drift of the probe's zero (A29). The zero stays behind the last deflection, so zeros after touches of one direction
// are compared.
struct Zero {
  Vector3d drift_mm_min, sd_drift_mm_min;
};
std::optional<Zero> zeroOf(const CheckRun& run, const StillParts& parts) {
  struct Seen {
    double minutes;
    Vector3d zero;
  };
  std::map<Index, std::vector<Seen>> by_direction;
  auto directions = run.directions;
  const auto add = [&](const StillWindow& window, double minutes, std::size_t touched) {
    if (window.times.empty()) return;
    by_direction[directionOf(directions, run.recorded[touched].plan.normal)].push_back(
        {minutes, window.values.colwise().mean().transpose()});
  };
  for (std::size_t i = 0; i < run.touches.size(); ++i) {
    const CheckTouch& one = run.touches[i];
    // What was touched before the first one is not known.
    if (one.recorded > 0) add(parts.free[i], one.minutes, one.recorded - 1);
    add(parts.after[i], one.minutes, one.recorded);
  }
  double weight = 0, dof = -1;
  Vector3d sum = Vector3d::Zero(), squares = Vector3d::Zero();
  for (const auto& [direction, seen] : by_direction) {
    const auto n = static_cast<double>(seen.size());
    double mean_min = 0;
    Vector3d mean = Vector3d::Zero();
    for (const auto& [minutes, zero] : seen) mean_min += minutes / n, mean += zero / n;
    for (const auto& [minutes, zero] : seen) {
      weight += (minutes - mean_min) * (minutes - mean_min);
      sum += (minutes - mean_min) * (zero - mean);
      squares += (zero - mean).cwiseAbs2();
    }
    dof += n - 1;
  }
  if (!(weight > 0) || dof < 2) return std::nullopt;
  const Vector3d drift = sum / weight;
  const Vector3d left = (squares - weight * drift.cwiseAbs2()).cwiseMax(0.0);
  return Zero{drift, (left / dof / weight).cwiseSqrt()};
}

template <typename Vector>
std::vector<double> listOf(const Vector& vector) {
  return {vector.begin(), vector.end()};
}

void addLine(Result& result, std::span<const StillWindow> windows, const Quantity& amplitude, const Quantity& frequency,
             const std::string& of) {
  const auto line = noiseLine(windows);
  if (!line) return;
  result.also.push_back(Estimate::scalar(amplitude, line->amplitude_mm, line->sd_amplitude_mm));
  result.also.push_back(Estimate::scalar(frequency, line->frequency_hz, line->sd_frequency_hz));
  const double f = line->frequency_hz, rate = line->rate_hz;
  result.unobservable.push_back("whether the line of " + text(std::round(10 * f) / 10) + " Hz in the noise of " + of +
                                " is an alias: at " + text(std::round(rate)) + " samples/s vibrations of " +
                                text(std::round(rate - f)) + " and " + text(std::round(rate + f)) +
                                " Hz look the same");
}

void addNoise(Result& result, const StillParts& parts) {
  if (const auto noise = noiseAtRest(parts.rest)) {
    result.estimates.push_back(
        Estimate::vector(quantity::kNoiseMachine, listOf(noise->sd_mm), listOf(noise->sd_of_sd_mm)));
  } else {
    result.unobservable.emplace_back("noise of the machine at rest: it did not rest in the touches");
  }
  if (const auto noise = noiseAtRest(parts.free))
    result.estimates.push_back(
        Estimate::vector(quantity::kNoiseProbe, listOf(noise->sd_mm), listOf(noise->sd_of_sd_mm)));
  addLine(result, parts.rest, quantity::kLineMachine, quantity::kLineMachineHz, "the positions at rest");
  addLine(result, parts.contact, quantity::kLineContact, quantity::kLineContactHz, "the deflection in contact");
  addLine(result, parts.free, quantity::kLineFree, quantity::kLineFreeHz, "the deflection without contact");
}

void addDrift(Result& result, const CheckRun& run, const AllTouches& together, const std::optional<Zero>& zero) {
  constexpr double kUmPerMm = 1e3;
  Vector3d drift = together.parameters().segment<3>(run.driftAt());
  Vector3d variance = together.covariance().diagonal().segment<3>(run.driftAt());
  if (zero) {
    drift -= zero->drift_mm_min;
    variance += zero->sd_drift_mm_min.cwiseAbs2();
  }
  result.estimates.push_back(
      Estimate::vector(quantity::kDrift, listOf(kUmPerMm * drift), listOf(kUmPerMm * variance.cwiseSqrt())));
  if (!zero) {
    result.unobservable.emplace_back(
        "drift of the probe's zero, which is in that of the machine: too few touches have "
        "samples before their contact");
    return;
  }
  result.estimates.push_back(Estimate::vector(quantity::kZeroDrift, listOf(kUmPerMm * zero->drift_mm_min),
                                              listOf(kUmPerMm * zero->sd_drift_mm_min)));
}

// Lost motion with the probe's hysteresis, and the repeatability that follows from it.
void addReversal(Result& result, const CheckRun& run, const AllTouches& together, const Scatter& scatter) {
  const Index at = run.othersAt();
  MatrixXd chosen = MatrixXd::Zero(3, run.unknowns());
  chosen.middleCols(at + kLostAt, 3).setIdentity();
  chosen.col(at + kHysteresisAt).setOnes();
  const Vector3d lost = chosen * together.parameters();
  const Vector3d variance = (chosen * together.covariance() * chosen.transpose()).diagonal();
  auto estimate = Estimate::vector(quantity::kLostMotion, listOf(lost), listOf(variance.cwiseSqrt()));
  if (const auto cofactor = unitCofactor(together.designRows())) {
    MatrixXd own = MatrixXd::Zero(3, kHysteresisAt + 1);
    own.middleCols(kLostAt, 3).setIdentity();
    own.col(kHysteresisAt).setOnes();
    estimate.design = listOf(VectorXd{(own * *cofactor * own.transpose()).diagonal().cwiseSqrt()});
    result.design_per = kOneWay;
  }
  result.estimates.push_back(std::move(estimate));
  const double in = scatter.sdIn(), out = scatter.sdOut();
  const double both = in * in + out * out + 2 * scatter.correlation * scatter.correlation * in * out;
  std::vector<double> repeatability, sd;
  for (Index axis = 0; axis < 3; ++axis) {
    const double one_way = 4 * std::max(scatter.in_mm, scatter.out_mm);
    const double both_ways = 2 * scatter.in_mm + 2 * scatter.out_mm + std::abs(lost[axis]);
    repeatability.push_back(std::max(one_way, both_ways));
    sd.push_back(one_way > both_ways ? 4 * (scatter.in_mm > scatter.out_mm ? in : out)
                                     : std::sqrt(4 * both + variance[axis]));
  }
  result.estimates.push_back(Estimate::vector(quantity::kRepeatability, repeatability, sd));
  result.also.push_back(Estimate::scalar(quantity::kHysteresis, together.parameters()[at + kHysteresisAt],
                                         std::sqrt(together.covariance()(at + kHysteresisAt, at + kHysteresisAt))));
  result.also.push_back(Estimate::scalar(quantity::kTouchScatterIn, scatter.in_mm, in));
  result.also.push_back(Estimate::scalar(quantity::kTouchScatterOut, scatter.out_mm, out));
}

void addForm(Result& result, const CheckRun& run, const AllTouches& together, const SphereForm& form) {
  const auto readings = readingsOfForm(run, together, form);
  if (const auto range = formRange(readings, false))
    result.estimates.push_back(Estimate::scalar(quantity::kForm3d, range->value_mm, range->sd_mm));
  if (const auto range = formRange(readings, true))
    result.estimates.push_back(Estimate::scalar(quantity::kForm2d, range->value_mm, range->sd_mm));
  result.estimates.push_back(Estimate::matrix(quantity::kLobing, 1, listOf(form.lobes_mm), listOf(form.sd_lobes_mm)));
  if (!form.explained) {
    result.warnings.emplace_back(
        "form-not-of-lobes: the places of the directions miss two to four lobes by more than their noise; the map "
        "shows where: look for dirt on sphere and stylus, a loose stylus, the squareness of the axes and the scale of "
        "the axes");
  }
  std::vector<double> map, sd;
  for (Index d = 0; d < run.driftAt(); ++d) {
    const Vector3d& u = run.directions[static_cast<std::size_t>(d)];
    map.insert(map.end(), {degrees(std::atan2(u.y(), u.x())), degrees(std::asin(std::clamp(u.z(), -1.0, 1.0))),
                           form.found_mm[d], form.by_lobes_mm[d]});
    sd.insert(sd.end(), {0, 0, form.sd_found_mm[d], 0});
  }
  result.also.push_back(Estimate::matrix(quantity::kFormByDirection, std::size(quantity::kFormColumns), map, sd));
}

void addCurvature(Result& result, const CheckRun& run, const AllTouches& together) {
  const Index at = run.othersAt();
  double depth_mm = 0;
  for (const auto& one : run.touches) depth_mm += one.depth_mm / static_cast<double>(run.count());
  const double bent = kBentByBounce * together.parameters()[at + kHysteresisAt] / (depth_mm * depth_mm);
  const Vector3d variance = together.covariance().diagonal().segment<3>(at + kBendAt).array() + bent * bent;
  result.estimates.push_back(Estimate::vector(
      quantity::kGainCurvature, listOf(together.parameters().segment<3>(at + kBendAt)), listOf(variance.cwiseSqrt())));
}

// Delay of each axis, centre and size come along.
void addTheRest(Result& result, const CheckRun& run, const AllTouches& together, const SphereForm& form,
                std::optional<double> known_mm) {
  const Index at = run.othersAt();
  result.also.push_back(
      Estimate::vector(quantity::kTauAxis, listOf(together.parameters().segment<3>(at)),
                       listOf(VectorXd{together.covariance().diagonal().segment<3>(at).cwiseSqrt()})));
  result.also.push_back(Estimate::vector(quantity::kCentre, listOf(form.centre_mm), listOf(form.sd_centre_mm)));
  result.also.push_back(Estimate::scalar(quantity::kEffectiveDiameter, 2 * form.radius_mm, 2 * form.sd_radius_mm));
  if (known_mm)
    result.estimates.push_back(
        Estimate::scalar(quantity::kStaticError, 2 * form.radius_mm - *known_mm, 2 * form.sd_radius_mm));
}

}  // namespace

Outcome<Result, Refusal> solveMachineCheck(const Dataset& dataset) {
  if (auto refusal = refuseTurnedProbe(dataset)) return *refusal;
  TRY(const auto known_mm, configPositive(dataset, "effective_diameter_mm"));
  TRY(const auto run, readCheckRun(dataset));
  AllTouches together{run};
  if (auto refusal = together.fit()) return *refusal;
  if (together.condition() > kGoodCondition) {
    return Refusal{
        "way-in-missing",
        "too few ways in are of use to tell lost motion from the delay: touch more slowly, so that the stylus "
        "does not bounce"};
  }
  TRY(const auto form, formOf(run, together));
  TRY(const auto parts, stillParts(run));
  const Scatter scatter = scatterOf(run, together);
  const auto zero = zeroOf(run, parts);

  Result result;
  result.method = dataset.method;
  result.convention =
      "R, s and lost motion (reversal value) as ISO 230-2, P_FTU as ISO 10360-5 and ISO 230-10; lobes and form "
      "outwards "
      "positive, azimuth from +X to +Y; a drift of the machine moves what is touched";
  result.warnings = run.warnings;
  result.dropped = run.dropped;
  addReversal(result, run, together, scatter);
  addForm(result, run, together, form);
  addCurvature(result, run, together);
  addDrift(result, run, together, zero);
  addNoise(result, parts);
  addTheRest(result, run, together, form, known_mm);
  result.dof = together.dof();
  result.condition = together.condition();
  result.residuals = {.unit = "mm", .against = "t_min", .names = {}, .at = {}, .values = {}};
  double squares = 0;
  for (Index i = 0; i < run.count(); ++i) {
    const CheckTouch& one = run.touches[static_cast<std::size_t>(i)];
    result.residuals.names.push_back(one.touch.plan.name);
    result.residuals.at.push_back(one.minutes + run.half_min);
    result.residuals.values.push_back(together.off(i)[0]);
    squares += together.off(i)[0] * together.off(i)[0];
  }
  result.rms = std::sqrt(squares / static_cast<double>(run.count()));
  return result;
}

namespace {

constexpr MethodKey kCheckKeys[]{
    {"effective_diameter_mm", "",
     "certified diameter of sphere plus stylus ball; if given, static_error_mm is answered too"},
    kProbeAtZero,
    kProbeB};
constexpr Quantity kCheckResults[]{quantity::kLostMotion, quantity::kRepeatability, quantity::kForm3d,
                                   quantity::kForm2d,     quantity::kLobing,        quantity::kGainCurvature,
                                   quantity::kDrift,      quantity::kZeroDrift,     quantity::kNoiseMachine,
                                   quantity::kNoiseProbe, quantity::kStaticError};
constexpr Quantity kCheckFurther[]{quantity::kHysteresis,      quantity::kTouchScatterIn, quantity::kTouchScatterOut,
                                   quantity::kFormByDirection, quantity::kLineMachine,    quantity::kLineMachineHz,
                                   quantity::kLineContact,     quantity::kLineContactHz,  quantity::kLineFree,
                                   quantity::kLineFreeHz};
constexpr std::string_view kCheckUnobservable[]{
    "scale and squareness of the axes: on one sphere they look like two lobes and like its size; the positions of two "
    "spheres at a certified distance, or sphere-fit at several places, show them",
    "form of the sphere apart from that of the stylus ball and the probe's lobes: they are one map",
    "lobes that go once around: they displace the stylus ball, and every centre alike", of_delay::kApart};

}  // namespace

const Method kMachineCheck{.name = "machine-check",
                           .title = "What the machine and its probe are",
                           .equations = "(A7a), (A25)-(A29)",
                           .source = "none; terms of ISO 230-2, ISO 230-10, ISO 10360-5",
                           .solver = solveMachineCheck,
                           .measures_machine = true,
                           .tables = of_delay::kTouchTables,
                           .keys = kCheckKeys,
                           .known = std::span{of_delay::kDiameterKnown}.first<2>(),
                           .results = kCheckResults,
                           .further = kCheckFurther,
                           .unobservable = kCheckUnobservable,
                           .subject = {.about = Subject{SubjectKind::machine}}};

}  // namespace probebox::metrology
