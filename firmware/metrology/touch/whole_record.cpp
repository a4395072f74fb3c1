#include "firmware/metrology/touch/whole_record.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/chi_square.hpp"
#include "firmware/metrology/fit/decompositions.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/fit/neighbour_correlation.hpp"
#include "firmware/metrology/fit/sphere.hpp"
#include "firmware/metrology/touch/sample_correlation.hpp"
#include "firmware/metrology/touch/size_line.hpp"
#include "firmware/metrology/touch/touch_model.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr int kNoiseRounds = 3;
constexpr double kUnexplained = 1e-5;     // probability that a way in scatters so much more than the ways out
constexpr double kCorrelated = 3.0;       // sd, by which neighbours have to agree
constexpr double kLeastScatterDof = 8.0;  // to tell noise by
constexpr double kClearBounce = 25.0;     // of chi-square, that it explains
constexpr double kBendScatter = 4.0;      // sd, by which bends may differ to be one
constexpr double kLostDeviations = 5.0;
constexpr double kLeastLost_mm = 0.002;
constexpr double kGoodCondition = 300.0;  // for lost motion to stand alone

// Samples of touches at one speed have one noise; along one axis, where the axes have delays of their own.
using Group = std::pair<long, Index>;
Group groupOf(const TouchPlan& plan, bool by_axis) {
  Index axis = 0;
  if (by_axis) plan.retract.cwiseAbs().maxCoeff(&axis);
  return {std::lround(100.0 * plan.speed_mm_s), axis};
}

// Squares of residuals that the unknowns take where neighbours are correlated: more than of independent ones by the
// factor on a sum of many samples, nearly.
double takenBy(const Leftover& left, double r) {
  return std::min(left.leverage * std::pow((1.0 + r) / (1.0 - r), 0.9), 0.7 * left.count);
}

// Correlation of neighbours, from all samples of a stream.
NeighbourCorrelation correlationOf(const Leftover& all) {
  if (all.dof() < kLeastScatterDof || !(all.squares > 0.0)) return {};
  const auto expected = [&](double r) {
    const double taken = takenBy(all, r);
    return (all.count * r - all.shared / all.leverage * taken) / (all.count - taken);
  };
  const double found = all.products / all.squares;
  const double beyond = (found - expected(0.0)) * std::sqrt(all.dof());
  if (beyond < kCorrelated) return {};
  return neighbourCorrelation(found, beyond, expected);
}

double deviation(const Leftover& left, double r, double least, double otherwise) {
  if (left.dof() < kLeastScatterDof) return std::max(otherwise, least);
  return std::max(std::sqrt(left.squares / (left.count - takenBy(left, r))), least);
}

double medianOf(std::vector<double> values) {
  std::ranges::sort(values);
  return values.empty() ? 0.0 : values[values.size() / 2];
}

class TouchesOfRun {
 public:
  TouchesOfRun(std::vector<TouchRecord> records, std::vector<TouchPlan> plans, bool by_axis)
      : records_{std::move(records)},
        plans_{std::move(plans)},
        by_axis_{by_axis},
        without_way_in_(records_.size()),
        own_(records_.size()) {
    for (std::size_t i = 0; i < records_.size(); ++i) {
      auto& [machine, probe] = noise_[groupOf(plans_[i], by_axis_)];
      machine.push_back(records_[i].noise().machine);
      probe.push_back(records_[i].noise().probe);
      without_way_in_[i] = !records_[i].hasWayIn();
    }
    for (auto& [group, of_touches] : noise_) {
      const auto middle = [](const std::vector<StreamNoise>& all, double StreamNoise::*sd) {
        std::vector<double> values;
        for (const auto& one : all) values.push_back(one.*sd);
        return medianOf(values);
      };
      const auto usual = [&](const std::vector<StreamNoise>& all) {
        return StreamNoise{middle(all, &StreamNoise::moving), middle(all, &StreamNoise::at_rest), 0.0};
      };
      pooled_[group] = {usual(of_touches.first), usual(of_touches.second)};
    }
  }

  // Fits all touches, the noise by what is left of them.
  std::optional<Refusal> fit() {
    for (int round = 0; round <= kNoiseRounds; ++round) {
      fitEach();
      if (auto refusal = tooFew()) return refusal;
      if (leaveOutWaysIn()) {
        fitEach();
        if (auto refusal = tooFew()) return refusal;
      }
      findUsualBounce();
      // The first round's noise is too rough to tell a bounce by.
      for (std::size_t k = 0; round > 0 && k < touches_.size(); ++k) own_[fitted_[k]] = touches_[k].bounce;
      if (round < kNoiseRounds) pool();
    }
    return std::nullopt;
  }

  const std::vector<WholeTouch>& touches() const { return touches_; }
  const std::vector<std::size_t>& fitted() const { return fitted_; }  // places of those among all
  std::size_t waysInLeftOut() const { return left_out_; }
  std::size_t dof() const { return dof_; }
  std::vector<std::string> warnings() const {
    std::vector<std::string> all;
    if (machine_correlation_.is_clear) all.push_back(correlatedSamples("machine", machine_correlation_.r));
    if (probe_correlation_.is_clear) all.push_back(correlatedSamples("probe", probe_correlation_.r));
    return all;
  }

 private:
  void fitEach() {
    touches_.clear();
    fitted_.clear();
    std::vector<double> delays;
    std::vector<std::size_t> later;
    last_refusal_.reset();
    for (std::size_t i = 0; i < records_.size(); ++i) {
      if (!without_way_in_[i]) {
        auto fitted = records_[i].fit(pooled_[groupOf(plans_[i], by_axis_)], own_[i].value_or(usual_));
        if (fitted) {
          delays.push_back(fitted->tau_s());
          touches_.push_back(std::move(fitted).value());
          fitted_.push_back(i);
          continue;
        }
        last_refusal_ = fitted.error();
      }
      later.push_back(i);
    }
    if (delays.empty()) return;
    const double tau = medianOf(delays);
    for (const std::size_t i : later) {
      auto fitted = records_[i].fit(pooled_[groupOf(plans_[i], by_axis_)], usual_, tau);
      if (!fitted) {
        last_refusal_ = fitted.error();
        continue;
      }
      touches_.push_back(std::move(fitted).value());
      fitted_.push_back(i);
    }
  }

  std::optional<Refusal> tooFew() const {
    const bool some = std::ranges::any_of(touches_, &WholeTouch::has_way_in);
    if (some) return std::nullopt;
    if (last_refusal_) return last_refusal_;
    return Refusal{"way-in-missing", "no touch has a way in at constant speed: record the approach too"};
  }

  // Ways in whose bounce is not explained.
  bool leaveOutWaysIn() {
    bool some = false;
    for (std::size_t k = 0; k < touches_.size(); ++k) {
      const WholeTouch& touch = touches_[k];
      if (!touch.has_way_in) continue;
      const Leftover& in = touch.probe[static_cast<std::size_t>(State::in)];
      Leftover out;
      for (const auto& other : touches_) {
        if (groupOf(other.plan, by_axis_) == groupOf(touch.plan, by_axis_))
          out += other.probe[static_cast<std::size_t>(State::out)];
      }
      const double least = records_[fitted_[k]].leastNoise().probe.moving;
      const double inflation = probe_correlation_.inflation();
      const auto count = [&](const Leftover& of) { return static_cast<std::size_t>(of.dof() / inflation); };
      if (count(in) < 1 || count(out) < 2) continue;
      const double ratio = in.squares / in.dof() / std::max(out.squares / out.dof(), least * least);
      if (ChiSquareLaw{.dof = count(in), .noise_dof = count(out)}.probabilityAbove(ratio) > kUnexplained) continue;
      without_way_in_[fitted_[k]] = some = true;
      ++left_out_;
    }
    return some;
  }

  // That of the middle frequency: what shook a few touches is not how the stylus bounces.
  void findUsualBounce() {
    std::vector<Bounce> clear;
    for (const auto& touch : touches_)
      if (touch.bounce && touch.bounce_gain > kClearBounce) clear.push_back(*touch.bounce);
    if (clear.empty()) return;
    std::ranges::sort(clear, {}, &Bounce::frequency_hz);
    usual_ = clear[clear.size() / 2];
  }

  void pool() {
    Leftover of_machine, of_probe;
    std::map<Group, std::pair<std::array<Leftover, 2>, std::array<Leftover, 2>>> groups;  // moving, at rest
    for (const auto& touch : touches_) {
      auto& [machine, probe] = groups[groupOf(touch.plan, by_axis_)];
      for (const State state : kStates) {
        const auto s = static_cast<std::size_t>(state);
        const std::size_t at = state == State::rest ? 1 : 0;
        machine[at] += touch.machine[s];
        probe[at] += touch.probe[s];
        of_machine += touch.machine[s];
        of_probe += touch.probe[s];
      }
    }
    dof_ = static_cast<std::size_t>(std::max(1.0, std::min(of_machine.dof(), of_probe.dof())));
    machine_correlation_ = correlationOf(of_machine);
    probe_correlation_ = correlationOf(of_probe);
    for (auto& [group, scatter] : groups) {
      RecordNoise& noise = pooled_[group];
      const auto first =
          std::ranges::find_if(plans_, [&](const TouchPlan& one) { return groupOf(one, by_axis_) == group; });
      const RecordNoise& least = records_[static_cast<std::size_t>(first - plans_.begin())].leastNoise();
      // Where a group has few, all samples together tell its noise.
      const auto set = [](StreamNoise& stream, const std::array<Leftover, 2>& found, const Leftover& of_all, double r,
                          const StreamNoise& floor) {
        stream.moving = deviation(found[0], r, floor.moving, deviation(of_all, r, floor.moving, stream.moving));
        stream.at_rest = deviation(found[1], r, floor.at_rest, stream.moving);
        stream.correlation = r;
      };
      set(noise.machine, scatter.first, of_machine, machine_correlation_.r, least.machine);
      set(noise.probe, scatter.second, of_probe, probe_correlation_.r, least.probe);
    }
  }

  std::vector<TouchRecord> records_;
  std::vector<TouchPlan> plans_;
  bool by_axis_;
  std::vector<bool> without_way_in_;
  std::map<Group, std::pair<std::vector<StreamNoise>, std::vector<StreamNoise>>> noise_;
  std::map<Group, RecordNoise> pooled_;
  std::vector<WholeTouch> touches_;
  std::vector<std::size_t> fitted_;
  std::optional<Refusal> last_refusal_;
  std::size_t left_out_{};
  std::size_t dof_{};
  Bounce usual_{};
  std::vector<std::optional<Bounce>> own_;  // of each touch, once its noise is known
  NeighbourCorrelation machine_correlation_;
  NeighbourCorrelation probe_correlation_;
};

// Equations of all touches: apparent delay, distance from the centre, and bend, three rows each.
class Agreement {
 public:
  Agreement(const std::vector<WholeTouch>& touches, MatrixXd carried, const WholeRecordQuestion& question)
      : touches_{touches}, carried_{std::move(carried)}, lost_mm_{question.lost_mm}, shape_{question.shape} {
    MatrixXd normals{std::ssize(touches), 3};
    for (Index i = 0; i < normals.rows(); ++i) normals.row(i) = touch(i).plan.normal.transpose();
    span_ = spanOf(normals);
    const MatrixXd by_axis = lostByAxis();
    lost_ = lostColumns(by_axis);
    // What is fitted is not known.
    known_ = lost() > 0 ? VectorXd::Zero(by_axis.rows()) : VectorXd{lost_mm_ * by_axis.rowwise().sum()};
  }

  Index delays() const { return carried_.cols(); }
  Index lost() const { return lost_.cols(); }
  Index dimensions() const { return span_.cols(); }
  Index centreAt() const { return delays() + lost(); }
  Index radiusAt() const { return centreAt() + dimensions(); }
  Index parameters() const { return radiusAt() + 2; }  // radius and bend
  const MatrixXd& span() const { return span_; }
  VectorXd armOf(const WholeTouch& one, const VectorXd& at) const {
    return span_.transpose() * one.surface - at.segment(centreAt(), dimensions());
  }
  VectorXd outwards(const WholeTouch& one, const VectorXd& at) const {
    return shape_.outwards(armOf(one, at), span_.transpose() * one.plan.normal);
  }
  // Distance of the touched place from the fitted surface, mm.
  double off_mm(const WholeTouch& one, const VectorXd& at) const {
    return outwards(one, at).dot(armOf(one, at)) - at[radiusAt()] - shape_.beyond_mm(one.plan.normal);
  }

  std::optional<VectorXd> start() const {
    MatrixXd points{std::ssize(touches_), dimensions()};
    for (Index i = 0; i < points.rows(); ++i) {
      const Eigen::Vector3d& normal = touch(i).plan.normal;
      points.row(i) = (span_.transpose() * (touch(i).surface - shape_.beyond_mm(normal) * normal)).transpose();
    }
    VectorXd at = VectorXd::Zero(parameters());
    double tau = 0.0;
    double count = 0.0;
    for (const auto& one : touches_) {
      if (one.has_way_in) tau += one.tau_s(), count += 1.0;
    }
    at.head(delays()).setConstant(tau / count);
    const auto ball = algebraicBall(points);
    if (!ball) return std::nullopt;
    at.segment(centreAt(), dimensions()) = ball->centre;
    at[radiusAt()] = ball->radius;
    return at;
  }

  // Change of each parameter, one row each, when one touch, one column each, lies 1 mm further along its normal: as if
  // it alone had a smaller radius, or a larger one where it is touched from within.
  MatrixXd perShift(const Fit& fit, bool common_bend) const {
    const MatrixXd jacobian = evaluate(fit.parameters, common_bend).jacobian;
    MatrixXd changes{parameters(), std::ssize(touches_)};
    for (Index i = 0; i < changes.cols(); ++i) {
      const auto of_touch = jacobian.middleRows(3 * i, 3);
      const double outward = outwards(touch(i), fit.parameters).dot(span_.transpose() * touch(i).plan.normal);
      changes.col(i) = outward * fit.cofactor * of_touch.transpose() * of_touch.col(radiusAt());
    }
    return changes;
  }

  // bends: whether the touches have one bend, else each its own.
  Linearised evaluate(const VectorXd& at, bool common_bend) const {
    const Index n = std::ssize(touches_);
    Linearised model{VectorXd::Zero(3 * n), MatrixXd::Zero(3 * n, parameters())};
    for (Index i = 0; i < n; ++i) {
      const WholeTouch& one = touch(i);
      Eigen::Vector3d off;
      MatrixXd rows = MatrixXd::Zero(3, parameters());
      const VectorXd direction = outwards(one, at);
      const double seen = direction.dot(span_.transpose() * one.plan.retract);
      const double apparent =
          (carried_.row(i) * at.head(delays()) + lost_.row(i) * at.segment(delays(), lost())).value() + known_[i];
      off[0] = one.has_way_in ? one.tau_s() - apparent : 0.0;
      off[1] = off_mm(one, at);
      off[2] = one.values[3] - at[parameters() - 1];
      rows.block(1, centreAt(), 1, dimensions()) = -direction.transpose();
      rows(1, radiusAt()) = -1.0;
      rows(2, parameters() - 1) = -1.0;
      if (one.has_way_in) {
        rows.block(0, 0, 1, delays()) = -carried_.row(i);
        rows.block(0, delays(), 1, lost()) = -lost_.row(i);
      } else {
        // The place moves with the delay that it was taken with.
        const double moved = seen * one.speed_out_mm_s;
        off[1] += moved * (apparent - one.tau_s());
        rows.block(1, 0, 1, delays()) = moved * carried_.row(i);
        rows.block(1, delays(), 1, lost()) = moved * lost_.row(i);
      }
      // Covariance of what was measured: delay, distance, bend.
      Matrix3d all;
      const auto& c = one.covariance;
      all << c(0, 0), seen * c(0, 1), c(0, 3), seen * c(0, 1), seen * seen * c(1, 1), seen * c(1, 3), c(0, 3),
          seen * c(1, 3), c(3, 3);
      all(1, 1) += std::max(0.0, 1.0 - seen * seen) * one.across_variance;
      if (!one.has_way_in) all(0, 0) = 1.0;
      if (!common_bend) {
        off[2] = 0.0;
        rows.row(2).setZero();
        all.row(2).setZero();
        all.col(2).setZero();
        all(2, 2) = 1.0;
      }
      const MatrixXd factor = inverse(MatrixXd{lowerCholesky(scaled(all))});
      const Eigen::Vector3d sizes = all.diagonal().cwiseSqrt().cwiseInverse();
      model.residuals.segment<3>(3 * i) = factor * sizes.cwiseProduct(off);
      model.jacobian.middleRows(3 * i, 3) = factor * sizes.asDiagonal() * rows;
    }
    if (!common_bend) model.jacobian(2, parameters() - 1) = 1.0;  // of no use
    return model;
  }

 private:
  const WholeTouch& touch(Index i) const { return touches_[static_cast<std::size_t>(i)]; }

  static Matrix3d scaled(const Matrix3d& covariance) {
    const Eigen::Vector3d sizes = covariance.diagonal().cwiseSqrt().cwiseInverse();
    return sizes.asDiagonal() * covariance * sizes.asDiagonal();
  }

  // Apparent delay of each touch by a mm of lost motion of each axis.
  MatrixXd lostByAxis() const {
    MatrixXd by_axis{std::ssize(touches_), 3};
    for (Index i = 0; i < by_axis.rows(); ++i) {
      const WholeTouch& one = touch(i);
      const double way = one.has_way_in ? -1.0 / (one.speed_in_mm_s + one.speed_out_mm_s) : -0.5 / one.speed_out_mm_s;
      by_axis.row(i) = way * one.plan.retract.cwiseAbs().transpose();
    }
    return by_axis;
  }

  // Columns that are fitted: per axis where the speeds of the touches part it from the delays, of all axes together
  // where that is parted, or none.
  MatrixXd lostColumns(const MatrixXd& by_axis) const {
    const Index n = by_axis.rows();
    double slowest = INFINITY, fastest = 0.0;
    for (const auto& one : touches_) {
      if (!one.has_way_in) continue;
      slowest = std::min(slowest, one.speed_out_mm_s);
      fastest = std::max(fastest, one.speed_out_mm_s);
    }
    const MatrixXd none{n, 0};
    if (!(fastest > 0.0) || refuseSpeeds(slowest, fastest)) return none;
    const auto stands = [&](const MatrixXd& columns) {
      MatrixXd rows{0, delays() + columns.cols()};
      for (Index i = 0; i < n; ++i) {
        if (!touch(i).has_way_in) continue;
        rows.conservativeResize(rows.rows() + 1, Eigen::NoChange);
        rows.bottomRows(1).leftCols(delays()) = carried_.row(i);
        rows.bottomRows(1).rightCols(columns.cols()) = columns.row(i);
      }
      return rows.rows() >= rows.cols() && scaledCondition(rows.transpose() * rows) < kGoodCondition;
    };
    if (stands(by_axis)) return by_axis;
    const MatrixXd together = by_axis.rowwise().sum();
    return stands(together) ? together : none;
  }

  const std::vector<WholeTouch>& touches_;
  MatrixXd carried_;
  double lost_mm_;
  TouchedShape shape_;
  VectorXd known_;  // apparent delay of each touch by lost motion that is known
  MatrixXd span_;
  MatrixXd lost_;
};

double rootMeanSquareBend(const std::vector<WholeTouch>& touches) {
  double squares = 0.0;
  for (const auto& one : touches) squares += one.values[3] * one.values[3];
  return std::sqrt(squares / static_cast<double>(touches.size()));
}

// At one speed lost motion looks like delay, but not at rest. known_mm: of every axis.
std::optional<std::string> lostMotionAtRest(const std::vector<WholeTouch>& touches, double known_mm) {
  double weights = 0.0;
  double sum = 0.0;
  double speed = 0.0;
  for (const auto& one : touches) {
    if (!(one.lost_at_rest_variance > 0.0) || !one.has_way_in) continue;
    weights += 1.0 / one.lost_at_rest_variance;
    sum += (one.lost_at_rest_mm - known_mm * one.plan.retract.cwiseAbs().sum()) / one.lost_at_rest_variance;
    speed = one.speed_out_mm_s;
  }
  if (!(weights > 0.0)) return std::nullopt;
  const double off_mm = sum / weights;
  if (std::abs(off_mm) < std::max(kLostDeviations / std::sqrt(weights), kLeastLost_mm)) return std::nullopt;
  return "lost-motion: at rest the machine stands as with " + text(1e3 * off_mm) +
         " um of lost motion or hysteresis of the probe, which at this one speed is " +
         text(1e6 * off_mm / (2.0 * speed)) + " us of the delay: touch at a second speed too, or state lost_motion_mm";
}

}  // namespace

Outcome<WholeRecord, Refusal> fitWholeRecord(std::span<const Touch> touches, const WholeRecordQuestion& question) {
  const StampJitter jitter = stampJitter(touches);
  std::vector<TouchRecord> records;
  std::vector<TouchPlan> plans;
  std::vector<Index> read;
  std::optional<Refusal> why;
  for (std::size_t i = 0; i < touches.size(); ++i) {
    auto record = TouchRecord::read(touches[i], jitter);
    if (!record) {
      why = record.error();
      continue;
    }
    records.push_back(std::move(record).value());
    plans.push_back(touches[i].plan);
    read.push_back(static_cast<Index>(i));
  }
  if (records.empty()) return why.value_or(Refusal{"too-few-readings", "no touch is left to fit: measure again"});
  TouchesOfRun run{std::move(records), std::move(plans), question.carried.cols() > 1};
  if (auto refusal = run.fit()) return *refusal;
  std::vector<Index> rows;
  for (const std::size_t k : run.fitted()) rows.push_back(read[k]);
  const Agreement agreement{run.touches(), question.carried(rows, Eigen::all), question};
  const auto start = agreement.start();
  if (!start) return Refusal{"coplanar", "the touched points determine no centre: touch more sides"};

  const auto settle = [&](bool common_bend) {
    return leastSquares([&](const VectorXd& at) { return agreement.evaluate(at, common_bend); }, *start);
  };
  bool common_bend = true;
  auto fit = settle(true);
  if (!fit) return fit.error();
  double bends = 0.0;
  for (std::size_t i = 0; i < run.touches().size(); ++i) {
    const WholeTouch& one = run.touches()[i];
    bends += std::pow(one.values[3] - fit->parameters[agreement.parameters() - 1], 2) / one.covariance(3, 3);
  }
  const double of_bends = static_cast<double>(run.touches().size()) - 1.0;
  if (bends > of_bends + kBendScatter * std::sqrt(2.0 * std::max(of_bends, 1.0))) {
    common_bend = false;
    fit = settle(false);
    if (!fit) return fit.error();
  }
  const VectorXd& at = fit->parameters;
  WholeRecord result;
  const Index n = agreement.dimensions();
  MatrixXd chosen = MatrixXd::Identity(at.size(), at.size());
  chosen(agreement.radiusAt(), agreement.radiusAt()) = 2.0;
  const MatrixXd centre = n == 3 ? agreement.span() : MatrixXd{MatrixXd::Identity(n, n)};
  chosen.block(agreement.centreAt(), agreement.centreAt(), n, n) = centre;
  result.tau_s = at.head(agreement.delays());
  result.lost_mm = at.segment(agreement.delays(), agreement.lost());
  result.centre = centre * at.segment(agreement.centreAt(), n);
  result.size_mm = 2.0 * at[agreement.radiusAt()];
  result.bend_per_mm = common_bend ? at[at.size() - 1] : rootMeanSquareBend(run.touches());
  result.covariance = chosen * fit->cofactor * chosen.transpose();
  result.per_shift = MatrixXd::Zero(at.size(), std::ssize(touches));
  result.per_shift(Eigen::all, rows) = chosen * agreement.perShift(*fit, common_bend);
  result.condition = fit->condition;
  result.noise_dof = run.dof();
  result.touches = run.touches();
  result.warnings = run.warnings();
  if (run.waysInLeftOut() > 0) {
    result.warnings.push_back("the way in of " + std::to_string(run.waysInLeftOut()) +
                              " touches was left out: no free oscillation explains how the stylus bounced there; "
                              "look for vibration");
  }
  if (agreement.lost() == 0) {
    if (auto warning = lostMotionAtRest(result.touches, question.lost_mm)) result.warnings.push_back(*warning);
  }
  result.off_mm = VectorXd::Zero(std::ssize(touches));
  result.worst.assign(touches.size(), std::numeric_limits<double>::infinity());
  std::size_t readings = 0;
  for (std::size_t i = 0; i < result.touches.size(); ++i) {
    const WholeTouch& one = result.touches[i];
    result.off_mm[rows[i]] = agreement.off_mm(one, at);
    result.worst[static_cast<std::size_t>(rows[i])] =
        fit->residuals.segment<3>(3 * static_cast<Index>(i)).cwiseAbs().maxCoeff();
    readings += 1U + (one.has_way_in ? 1U : 0U) + (common_bend ? 1U : 0U);
  }
  const std::size_t unknowns = static_cast<std::size_t>(agreement.parameters()) - (common_bend ? 0 : 1);
  result.chi2_dof = readings > unknowns ? readings - unknowns : 0;
  if (result.chi2_dof > 0) result.chi2_reduced = fit->residuals.squaredNorm() / static_cast<double>(result.chi2_dof);
  return result;
}

}  // namespace probebox::metrology
