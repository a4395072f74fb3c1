#include "firmware/metrology/touch/whole_touch.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <utility>

#include "firmware/metrology/fit/decompositions.hpp"
#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector4d;
using Eigen::VectorXd;

constexpr double kSettle_s = 0.0005;  // from the ends of a stretch
constexpr double kShallow = 0.04;     // of the overtravel: less does not count as contact
constexpr double kMostShallow = 0.1;
constexpr double kLongestRest_s = 0.15;  // of which samples are used, after the way in and before the way out
constexpr double kUsualBend = 0.1;       // of the gain at full depth, sd
constexpr double kOtherBounce = 12.0;    // by which one has to be better than the usual
constexpr double kUsualBounce = 0.2;     // of the overtravel, amplitude
constexpr double kBounceGain = 25.0;     // of chi-square, by which a bounce has to explain the record better
constexpr double kFarOff = 5.0;          // sd
constexpr int kMostRounds = 25;
constexpr std::size_t kRoundedHarmonics = 4;

double squared(double value) {
  return value * value;
}

std::size_t at(State state) {
  return static_cast<std::size_t>(state);
}

}  // namespace

Leftover& Leftover::operator+=(const Leftover& other) {
  squares += other.squares;
  products += other.products;
  count += other.count;
  leverage += other.leverage;
  shared += other.shared;
  return *this;
}

// Rows of both streams, linearised at some values.
class TouchRecord::Solver {
 public:
  Solver(const TouchRecord& record, const RecordNoise& noise, const Bounce& usual, std::optional<double> tau_s)
      : record_{record}, noise_{noise}, state_{record.start_, {}, {}}, fixed_{tau_s.has_value()}, usual_{usual} {
    if (tau_s) {
      state_.values[1] += (*tau_s - state_.values[0]) * out().line.slope.dot(along());
      state_.values[0] = *tau_s;
    }
    for (const auto& stretch : record.stretches_) {
      const bool unused = fixed_ && stretch.state == State::in;
      used_.push_back(!unused);
      state_.lines.emplace_back(stretch.line.mean.dot(along()), stretch.line.slope.dot(along()));
    }
  }

  std::optional<Refusal> run() {
    choose();
    if (auto refusal = tooFew()) return refusal;
    lookForBounce();
    for (int step = 0; step < kMostRounds; ++step) {
      if (step == 1 || step == 3) choose();
      if (auto refusal = tooFew()) return refusal;
      const double moved = improve();
      if (!std::isfinite(moved) || !state_.values.allFinite()) break;
      if (step == 4) leaveOutFarOff();
      if (step > 5 && moved < 1e-5) return tooFew();
    }
    if (!state_.values.allFinite() || !(state_.values[2] > 0.0) ||
        std::abs(state_.values[0] - record_.start_[0]) > 0.02) {
      return record_.refused("no-convergence", "machine and probe do not show the same motion in and out");
    }
    return tooFew();
  }

  WholeTouch answer() {
    linearise();
    MatrixXd rows = heldRows();
    const auto solved = solveInPlace(rows, VectorXd::Zero(rows.rows()));
    const MatrixXd upper = inverseOfUpper(solved.upper);
    WholeTouch touch;
    touch.plan = record_.plan_;
    touch.has_way_in = !fixed_;
    touch.channels = record_.channels_;
    touch.values = state_.values;
    touch.bounce = state_.bounce;
    touch.bounce_gain = bounce_gain_;
    touch.left_out = left_out_.size();
    const MatrixXd shape = jacobian_ * upper;  // orthonormal columns
    // Of the values by the rows as recorded.
    MatrixXd gains = MatrixXd::Zero(4, residuals_.size());
    gains.bottomRows(fixed_ ? 3 : 4) = upper.topRows(fixed_ ? 3 : 4) * shape.transpose();
    for (Index k = 0; k < gains.cols(); ++k) gains.col(k) /= rows_[static_cast<std::size_t>(k)].sd;
    touch.covariance = covarianceOf(gains);
    addLeftovers(touch, shape);
    for (std::size_t s = 0; s < columns_.size(); ++s) {
      const auto& [run, state, line] = record_.stretches_[s];
      if (columns_[s] < 0 || state != State::rest) continue;
      const double variance = upper.row(own() + ofBounce() + 2 * columns_[s]).squaredNorm() +
                              squared(noise_.machine.at_rest) / static_cast<double>(line.n);
      touch.lost_at_rest_mm = 2.0 * (state_.lines[s].first - line.mean.dot(along()));
      touch.lost_at_rest_variance = 4.0 * variance;
      touch.rest_from_s = record_.machine_.times[run.begin];
      touch.rest_until_s = record_.machine_.times[run.end - 1];
    }
    setSurface(touch);
    return touch;
  }

 private:
  struct Fitted {
    Vector4d values;
    std::vector<std::pair<double, double>> lines;  // of the stretches along the retract: middle and slope
    std::optional<Bounce> bounce;
  };
  struct Row {
    std::size_t stretch;
    std::size_t sample;
    bool of_probe;
    double sd;
  };

  const Eigen::Vector3d& along() const { return record_.plan_.retract; }
  const Stretch& out() const {
    return *std::ranges::find_if(record_.stretches_, [](const Stretch& one) { return one.state == State::out; });
  }
  double place(std::size_t stretch, double t) const {
    return state_.lines[stretch].first + state_.lines[stretch].second * (t - record_.stretches_[stretch].line.t_mean);
  }
  const StreamNoise& noiseOf(bool of_probe) const { return of_probe ? noise_.probe : noise_.machine; }
  double sdOf(bool of_probe, State state) const {
    const StreamNoise& noise = noiseOf(of_probe);
    return state == State::rest ? noise.at_rest : noise.moving;
  }

  // The samples that the present values put on the stretches while the stylus is deflected.
  void choose() {
    is_linear_ = false;
    rows_.clear();
    std::vector<bool> touched(record_.stretches_.size());
    const double shallow = std::clamp(6.0 * noise_.probe.moving / state_.values[2], kShallow * record_.depth_mm_,
                                      kMostShallow * record_.depth_mm_);
    contact_ = record_.probe_.times.front();
    bool in_contact = false;
    double way_in_ends = -1e300, way_out_begins = 1e300;
    for (std::size_t s = 0; s < touched.size(); ++s) {
      const Run run = record_.stretches_[s].run;
      if (record_.stretches_[s].state == State::in) way_in_ends = record_.machine_.times[run.end - 1];
      if (record_.stretches_[s].state == State::out)
        way_out_begins = std::min(way_out_begins, record_.machine_.times[run.begin]);
    }
    for (std::size_t s = 0; s < touched.size(); ++s) {
      if (!used_[s]) continue;
      const auto& [run, state, line] = record_.stretches_[s];
      const double from = record_.machine_.times[run.begin] + kSettle_s - state_.values[0];
      const double until = record_.machine_.times[run.end - 1] - kSettle_s - state_.values[0];
      const auto& times = record_.probe_.times;
      const auto begin = static_cast<std::size_t>(std::ranges::lower_bound(times, from) - times.begin());
      for (std::size_t k = begin; k < times.size() && times[k] <= until; ++k) {
        const double t = times[k] + state_.values[0];
        if (state_.values[1] - place(s, t) <= shallow) continue;
        if (state == State::rest && t > way_in_ends + kLongestRest_s && t < way_out_begins - kLongestRest_s) continue;
        if (std::ranges::binary_search(left_out_, k)) continue;
        if (!in_contact) contact_ = times[k], in_contact = true;
        rows_.push_back({s, k, true, sdOf(true, state)});
        touched[s] = true;
      }
    }
    // Contact itself is where the way in reaches the surface.
    for (std::size_t s = 0; s < touched.size(); ++s) {
      if (!touched[s] || record_.stretches_[s].state != State::in) continue;
      contact_ = record_.stretches_[s].line.t_mean +
                 (state_.values[1] - state_.lines[s].first) / state_.lines[s].second - state_.values[0];
    }
    columns_.assign(touched.size(), -1);
    Index next = 0;
    for (std::size_t s = 0; s < touched.size(); ++s) {
      if (!touched[s]) continue;
      columns_[s] = next++;
      const auto& [run, state, line] = record_.stretches_[s];
      // At rest the machine may stand elsewhere than its encoder says: the lost motion of the way in is still in it.
      if (state == State::rest) continue;
      for (std::size_t k = run.begin; k < run.end; ++k) {
        rows_.push_back({s, k, false, sdOf(false, state)});
      }
    }
    stretches_ = next;
  }

  std::optional<Refusal> tooFew() const {
    std::array<std::size_t, 3> of_probe{};
    for (const auto& row : rows_) {
      if (row.of_probe) ++of_probe[at(record_.stretches_[row.stretch].state)];
    }
    const std::size_t least = fixed_ ? 0 : 3;
    const bool enough = static_cast<Index>(rows_.size()) > own() + ofBounce() + 2 * stretches_;
    if (enough && of_probe[at(State::out)] >= 3 && of_probe[at(State::in)] >= least) return std::nullopt;
    return record_.refused(
        "too-few-samples",
        "fewer than three samples of the probe while the machine moves at constant speed; touch more slowly "
        "or deeper, or sample faster");
  }

  Index own() const { return fixed_ ? 3 : 4; }  // unknowns among the values: tau first, unless it is given
  Index ofBounce() const { return state_.bounce ? 4 : 0; }

  void linearise() {
    if (std::exchange(is_linear_, true)) return;
    const auto n = static_cast<Index>(rows_.size());
    jacobian_.setZero(n, own() + ofBounce() + 2 * stretches_);
    residuals_.resize(n);
    const double tau = state_.values[0], surface = state_.values[1], gain = state_.values[2], bend = state_.values[3];
    for (Index i = 0; i < n; ++i) {
      const auto& [s, k, of_probe, sd] = rows_[static_cast<std::size_t>(i)];
      const Index line = own() + ofBounce() + 2 * columns_[s];
      const double stamp = of_probe ? record_.probe_.times[k] + tau : record_.machine_.times[k];
      const double since = stamp - record_.stretches_[s].line.t_mean;
      if (!of_probe) {
        residuals_[i] = (record_.place_[k] - place(s, stamp)) / sd;
        jacobian_(i, line) = 1.0 / sd;
        jacobian_(i, line + 1) = since / sd;
        continue;
      }
      const double age = record_.probe_.times[k] - contact_;
      const Bounce* bounce = state_.bounce ? &*state_.bounce : nullptr;
      const Vector4d swing = bounce ? bounce->columns(age) : Vector4d::Zero();
      double h = surface - place(s, stamp);
      if (bounce) h += bounce->sine_mm * swing[0] + bounce->cosine_mm * swing[1];
      const double steep = gain * (1.0 + 2.0 * bend * h) / sd;
      residuals_[i] = (record_.deflection_[k] - gain * (h + bend * h * h)) / sd;
      Index column = 0;
      if (!fixed_) jacobian_(i, column++) = -steep * state_.lines[s].second;
      jacobian_(i, column++) = steep;
      jacobian_(i, column++) = (h + bend * h * h) / sd;
      jacobian_(i, column++) = gain * h * h / sd;
      if (bounce) jacobian_.block<1, 4>(i, column) = steep * swing.transpose();
      jacobian_(i, line) = -steep;
      jacobian_(i, line + 1) = -steep * since;
    }
  }

  // Of the unknowns that a record may hardly show: what they are off the usual, in its sd. So they do not run away.
  struct Held {
    Index unknown;
    double off;
    double sd;
  };
  std::vector<Held> held() const {
    std::vector<Held> all{{own() - 1, -state_.values[3], kUsualBend / record_.depth_mm_}};
    for (std::size_t s = 0; s < columns_.size(); ++s) {
      const auto& [run, state, line] = record_.stretches_[s];
      if (columns_[s] < 0 || state != State::rest) continue;
      const double slope = line.slope.dot(along());
      all.push_back({own() + ofBounce() + 2 * columns_[s] + 1, slope - state_.lines[s].second,
                     noise_.machine.at_rest / std::sqrt(line.sxx)});
    }
    if (!state_.bounce) return all;
    const Bounce& bounce = *state_.bounce;
    const double most = kUsualBounce * record_.depth_mm_;
    all.push_back({own(), -bounce.sine_mm, most});
    all.push_back({own() + 1, -bounce.cosine_mm, most});
    all.push_back({own() + 2, usual_.frequency_hz - bounce.frequency_hz, 0.35 * usual_.frequency_hz});
    all.push_back({own() + 3, usual_.decay_per_s - bounce.decay_per_s, usual_.decay_per_s});
    return all;
  }
  MatrixXd heldRows() const {
    const auto all = held();
    MatrixXd rows = MatrixXd::Zero(jacobian_.rows() + std::ssize(all), jacobian_.cols());
    rows.topRows(jacobian_.rows()) = jacobian_;
    for (Index i = 0; i < std::ssize(all); ++i) {
      const auto& [unknown, off, sd] = all[static_cast<std::size_t>(i)];
      rows(jacobian_.rows() + i, unknown) = 1.0 / sd;
    }
    return rows;
  }
  double squares() const {
    double sum = residuals_.squaredNorm();
    for (const auto& [unknown, off, sd] : held()) sum += squared(off / sd);
    return sum;
  }

  // One step, as long as it leads on; what it moves the values by, in their sd.
  double improve() {
    linearise();
    const double before_squares = squares();
    MatrixXd rows = heldRows();
    const auto all = held();
    VectorXd right = VectorXd::Zero(rows.rows());
    right.head(residuals_.size()) = residuals_;
    for (Index i = 0; i < std::ssize(all); ++i) {
      const auto& [unknown, off, sd] = all[static_cast<std::size_t>(i)];
      right[residuals_.size() + i] = off / sd;
    }
    const VectorXd step = solveInPlace(rows, right).solution;
    const Fitted before = state_;
    for (double share = 1.0; share > 0.05; share /= 2.0) {
      state_ = before;
      moveBy(share * step);
      linearise();
      if (squares() <= before_squares * (1.0 + 1e-9)) break;
    }
    const double scale_s = noise_.machine.moving / std::abs(out().line.slope.dot(along()));
    const Vector4d moved = state_.values - before.values;
    return std::abs(moved[0]) / scale_s + std::abs(moved[1]) / noise_.machine.moving;
  }

  void moveBy(const VectorXd& step) {
    is_linear_ = false;
    state_.values.tail(own()) += step.head(own());
    if (state_.bounce) {
      Bounce& bounce = *state_.bounce;
      bounce.sine_mm += step[own()];
      bounce.cosine_mm += step[own() + 1];
      bounce.frequency_hz = std::clamp(bounce.frequency_hz + std::clamp(step[own() + 2], -10.0, 10.0),
                                       0.5 * kLowestBounce_hz, 2.0 * kHighestBounce_hz);
      bounce.decay_per_s = std::clamp(bounce.decay_per_s + std::clamp(step[own() + 3], -40.0, 40.0), 5.0, 2000.0);
    }
    const Index lines = own() + ofBounce();
    for (std::size_t s = 0; s < columns_.size(); ++s) {
      if (columns_[s] < 0) continue;
      state_.lines[s].first += step[lines + 2 * columns_[s]];
      state_.lines[s].second += step[lines + 2 * columns_[s] + 1];
    }
  }

  // Of the probe's samples, with the machine's lines as they are.
  Unexplained unexplained() const {
    Unexplained record;
    record.most_mm = kUsualBounce * record_.depth_mm_;
    record.highest_hz = 0.5 / record_.probe_.period();
    std::vector<Index> rows;
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (!rows_[i].of_probe) continue;
      rows.push_back(static_cast<Index>(i));
      record.ages_s.push_back(record_.probe_.times[rows_[i].sample] - contact_);
    }
    record.others = jacobian_(rows, Eigen::seqN(0, own()));
    record.residuals = residuals_(rows);
    record.per_mm.resize(std::ssize(rows));
    for (Index i = 0; i < std::ssize(rows); ++i)
      record.per_mm[i] = state_.values[2] / rows_[static_cast<std::size_t>(rows[static_cast<std::size_t>(i)])].sd;
    return record;
  }

  void takeBounce(const Bounce& bounce) {
    state_.bounce = bounce;
    is_linear_ = false;
  }

  void lookForBounce() {
    if (fixed_) return;
    if (usual_.amplitude() > 0.0) {  // found before
      takeBounce(usual_);
      if (!usual_.off_surface) state_.bounce->sine_mm = state_.bounce->cosine_mm = 0.0;
      bounce_gain_ = kBounceGain;
      return;
    }
    linearise();
    const BounceSearch search{unexplained()};
    const bool is_usual = usual_.frequency_hz > 0.0;
    Bounce chosen = usual_;
    // Another one than that of other touches has to be better by more than chance.
    bounce_gain_ = is_usual ? search.fit(chosen) + kOtherBounce : 0.0;
    if (const auto other = search.best(bounce_gain_)) chosen = *other;
    if (is_usual || bounce_gain_ > kBounceGain) takeBounce(usual_ = chosen);
  }

  void leaveOutFarOff() {
    linearise();
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      if (rows_[i].of_probe && std::abs(residuals_[static_cast<Index>(i)]) > kFarOff)
        left_out_.push_back(rows_[i].sample);
    }
    std::ranges::sort(left_out_);
    if (2 * left_out_.size() > rows_.size() / 5) left_out_.clear();  // the model is at fault, not the samples
    choose();
  }

  // Of values that are sums of the rows: neighbours are correlated, and all samples of a stretch share what rounding
  // does to them.
  Eigen::Matrix4d covarianceOf(const MatrixXd& gains) const {
    Eigen::Matrix4d covariance = Eigen::Matrix4d::Zero();
    Vector4d carried = Vector4d::Zero();
    for (Index i = 0; i < gains.cols(); ++i) {
      const Row& row = rows_[static_cast<std::size_t>(i)];
      const bool follows = i > 0 && rows_[static_cast<std::size_t>(i) - 1].stretch == row.stretch &&
                           rows_[static_cast<std::size_t>(i) - 1].of_probe == row.of_probe;
      if (!follows) carried.setZero();
      const Vector4d gain = row.sd * gains.col(i);
      covariance += gain * gain.transpose() + gain * carried.transpose() + carried * gain.transpose();
      carried = noiseOf(row.of_probe).correlation * (carried + gain);
    }
    addRounding(covariance, gains);
    return covariance;
  }

  void addRounding(Eigen::Matrix4d& covariance, const MatrixXd& gains) const {
    for (const bool of_probe : {false, true}) {
      const Stream& stream = of_probe ? record_.probe_ : record_.machine_;
      const Eigen::Vector3d steps = stepsOf(stream);
      const Eigen::Vector3d& seen = of_probe ? record_.channels_ : along();
      for (std::size_t s = 0; s < columns_.size(); ++s) {
        if (columns_[s] < 0) continue;
        const Stretch& stretch = record_.stretches_[s];
        for (Index axis = 0; axis < 3; ++axis) {
          const double step = steps[axis];
          if (step <= 0.0 || std::abs(seen[axis]) < 0.01) continue;
          const double rate =
              of_probe ? -state_.values[2] * state_.lines[s].second * seen[axis] : stretch.line.slope[axis];
          const double sd = sdOf(of_probe, stretch.state);
          const double noise_square = std::max(sd * sd - step * step / 12.0, 0.0);
          for (std::size_t harmonic = 1; harmonic <= kRoundedHarmonics; ++harmonic) {
            const double turns = kTurn * static_cast<double>(harmonic) / step;
            const double power = 2.0 / squared(turns) * std::exp(-squared(turns) * noise_square);
            Eigen::Vector4cd sum = Eigen::Vector4cd::Zero();
            for (Index i = 0; i < gains.cols(); ++i) {
              const Row& row = rows_[static_cast<std::size_t>(i)];
              if (row.stretch != s || row.of_probe != of_probe) continue;
              const double since = stream.times[row.sample] - stretch.line.t_mean;
              sum += gains.col(i) * std::polar(1.0, turns * (stretch.state == State::rest ? 0.0 : rate * since));
            }
            covariance += squared(seen[axis]) * power * (sum * sum.adjoint()).real();
          }
        }
      }
    }
  }

  void addLeftovers(WholeTouch& touch, const MatrixXd& shape) const {
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const Row& row = rows_[i];
      const auto here = static_cast<Index>(i);
      Leftover& one = (row.of_probe ? touch.probe : touch.machine)[at(record_.stretches_[row.stretch].state)];
      one.squares += squared(residuals_[here] * row.sd);
      one.count += 1.0;
      one.leverage += shape.row(here).squaredNorm();
      if (i > 0 && rows_[i - 1].stretch == row.stretch && rows_[i - 1].of_probe == row.of_probe) {
        one.products += residuals_[here] * residuals_[here - 1] * squared(row.sd);
        one.shared += shape.row(here).dot(shape.row(here - 1));
      }
    }
  }

  // Between the places of both ways: what the delay moves them by cancels.
  void setSurface(WholeTouch& touch) const {
    touch.surface.setZero();
    double ways = 0.0;
    double samples = 0.0;
    for (std::size_t s = 0; s < columns_.size(); ++s) {
      const auto& [run, state, line] = record_.stretches_[s];
      if (columns_[s] < 0 || state == State::rest) continue;
      touch.surface += line.at(line.timeAt(along(), state_.values[1]));
      ways += 1.0;
      samples += static_cast<double>(run.size());
      (state == State::in ? touch.speed_in_mm_s : touch.speed_out_mm_s) = std::abs(state_.lines[s].second);
    }
    touch.surface /= ways;
    touch.surface += along() * (state_.values[1] - touch.surface.dot(along()));
    touch.across_variance = squared(noise_.machine.at_rest) / samples;
  }

  const TouchRecord& record_;
  RecordNoise noise_;
  Fitted state_;
  bool fixed_;                  // tau
  std::vector<bool> used_;      // stretches
  std::vector<Index> columns_;  // of the stretches in contact; -1 for others
  Index stretches_{};
  double contact_{};  // s, by the probe's stamps
  Bounce usual_;
  double bounce_gain_{};
  std::vector<Row> rows_;
  std::vector<std::size_t> left_out_;
  bool is_linear_{};  // the two below are those of the present rows and values
  MatrixXd jacobian_;
  VectorXd residuals_;
};

Outcome<WholeTouch, Refusal> TouchRecord::fit(const RecordNoise& noise, const Bounce& usual,
                                              std::optional<double> tau_s) const {
  Solver solver{*this, noise, usual, tau_s};
  if (auto refusal = solver.run()) return *refusal;
  return solver.answer();
}

}  // namespace probebox::metrology
