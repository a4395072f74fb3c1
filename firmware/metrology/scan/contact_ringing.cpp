#include "firmware/metrology/scan/contact_ringing.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

#include "firmware/metrology/fit/decompositions.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kLeastTurns = 2.0;  // within a contact: slower oscillations look like the motion
constexpr double kMostTurns = 50.0;
constexpr Index kLeastOfContact = 12;
constexpr double kSignificant = 4.0;                // deviations
constexpr double kFinestNoise = 1e-6;               // mm and raw: what kinks and the digits of a case file leave
constexpr std::array kDecays{1.0, 3.0, 6.0, 12.0};  // per contact

// Frequency and decay, per contact of the longest length.
struct Tone {
  double turns{};
  double decay{};
};

// Part of a contact's deflection that the machine's motion does not explain: orthogonal to the motion, its rate and a
// constant.
struct Beyond {
  ArrayXd since;    // s, from the first deflected sample
  MatrixXd motion;  // orthonormal columns
  VectorXd left;
  double variance{};  // of one sample

  MatrixXd without(const MatrixXd& columns) const { return columns - motion * (motion.transpose() * columns); }
};

std::optional<Beyond> beyondMotion(const DrivenContact& contact, double tau_s) {
  const Signal& machine = *contact.machine;
  const Signal& probe = *contact.probe;
  const Interpolant motion{machine, Interpolation::linear};
  std::vector<std::size_t> rows;
  for (std::size_t k = 0; k < probe.times.size(); ++k) {
    const double t = probe.times[k];
    const bool at_kink = std::abs(t + tau_s - contact.machine_apex_s) <= contact.kink_s;
    if (t >= contact.from && t <= contact.until && !at_kink) rows.push_back(k);
  }
  const auto n = static_cast<Index>(rows.size());
  if (n < kLeastOfContact) return std::nullopt;
  Beyond beyond{.since = ArrayXd{n}, .motion = {}, .left = VectorXd{n}};
  MatrixXd columns{n, 3};
  std::size_t cursor = 0;
  // The rate over so much more than a sample that hardly any noise is in it.
  const double aside = std::max(machine.period(), (contact.until - contact.from) / 40.0);
  for (Index i = 0; i < n; ++i) {
    const double t = probe.times[rows[static_cast<std::size_t>(i)]];
    beyond.since[i] = t - contact.from;
    beyond.left[i] = probe.values[rows[static_cast<std::size_t>(i)]];
    const auto behind = motion.at(t + tau_s - aside, cursor);
    const auto ahead = motion.at(t + tau_s + aside, cursor);
    columns.row(i) << 1.0, motion.at(t + tau_s, cursor).value, (ahead.value - behind.value) / (2.0 * aside);
  }
  columns.col(1).array() -= columns.col(1).mean();
  const double gain = columns.col(1).dot(beyond.left) / columns.col(1).squaredNorm();
  beyond.motion = orthonormalColumns(columns);
  beyond.left = beyond.without(beyond.left);
  // Probe samples between two of the machine share its noise.
  const double shared = gain * gain * std::max(1.0, machine.period() / probe.period());
  beyond.variance = std::max(smallerVariance(probe) + shared * smallerVariance(machine), kFinestNoise * kFinestNoise);
  return beyond;
}

class Contacts {
 public:
  Contacts(std::span<const DrivenContact> contacts, double tau_s) {
    for (const auto& contact : contacts) {
      auto beyond = beyondMotion(contact, tau_s);
      if (!beyond) continue;
      length_s_ = std::max(length_s_, contact.until - contact.from);
      period_s_ = std::max(period_s_, contact.probe->period());
      each_.push_back(std::move(*beyond));
    }
    complete_ = each_.size() == contacts.size();
  }

  std::optional<ContactRinging> ringing() const {
    if (!complete_) return std::nullopt;
    const Tone tone = refined(coarse());
    const double dof = 2.0 * static_cast<double>(each_.size()) + 2.0;
    if (explained(tone) < dof + kSignificant * std::sqrt(2.0 * dof)) return std::nullopt;
    ContactRinging found{.w = kTurn * tone.turns / length_s_, .decay = tone.decay / length_s_, .amplitudes = {}};
    for (const auto& one : each_) found.amplitudes.push_back(amplitude(one, tone));
    return found;
  }

 private:
  ArrayXd left(const Beyond& one, double decay) const { return (-decay / length_s_ * one.since).exp(); }
  Eigen::MatrixX2d turned(const Beyond& one, double turns) const {
    const ArrayXd turn = kTurn * turns / length_s_ * one.since;
    Eigen::MatrixX2d columns{turn.size(), 2};
    columns << turn.cos(), turn.sin();
    return columns;
  }
  static Eigen::Vector2d solveNormal(const MatrixXd& columns, const Eigen::Vector2d& products) {
    return solveCholesky(columns.transpose() * columns, products);
  }
  // Weighted squares that two columns take away.
  static double explained(const Beyond& one, const Eigen::MatrixX2d& phases) {
    const MatrixXd columns = one.without(phases);
    const Eigen::Vector2d products = columns.transpose() * one.left;
    return products.dot(solveNormal(columns, products)) / one.variance;
  }
  double explained(const Tone& tone) const {
    double squares = 0.0;
    for (const auto& one : each_) {
      squares += explained(one, left(one, tone.decay).matrix().asDiagonal() * turned(one, tone.turns));
    }
    return squares;
  }
  Eigen::Vector2d amplitude(const Beyond& one, const Tone& tone) const {
    const MatrixXd columns = one.without(left(one, tone.decay).matrix().asDiagonal() * turned(one, tone.turns));
    return solveNormal(columns, columns.transpose() * one.left);
  }
  Tone coarse() const {
    std::vector<std::array<VectorXd, kDecays.size()>> decaying(each_.size());
    for (std::size_t i = 0; i < each_.size(); ++i) {
      for (std::size_t k = 0; k < kDecays.size(); ++k) decaying[i][k] = left(each_[i], kDecays[k]);
    }
    Tone best{kLeastTurns, kDecays.front()};
    double most = 0.0;
    const double highest = std::min(0.45 * length_s_ / period_s_, kMostTurns);
    for (double turns = kLeastTurns; turns <= highest; turns += 0.25) {
      std::array<double, kDecays.size()> squares{};
      for (std::size_t i = 0; i < each_.size(); ++i) {
        const Eigen::MatrixX2d phases = turned(each_[i], turns);
        for (std::size_t k = 0; k < kDecays.size(); ++k) {
          squares[k] += explained(each_[i], decaying[i][k].asDiagonal() * phases);
        }
      }
      const auto top = std::ranges::max_element(squares);
      if (*top > most) most = *top, best = {turns, kDecays[static_cast<std::size_t>(top - squares.begin())]};
    }
    return best;
  }
  // Steps that halve whenever none of them leads on.
  Tone refined(Tone best) const {
    double most = explained(best);
    double step = 0.125;
    for (int round = 0; round < 60 && step > 1e-4; ++round) {
      bool better = false;
      for (const auto& [turns, decay] : {std::array{step, 0.0}, {-step, 0.0}, {0.0, 4.0 * step}, {0.0, -4.0 * step}}) {
        const Tone next{best.turns + turns, std::max(0.0, best.decay + decay)};
        const double squares = next.turns < kLeastTurns ? 0.0 : explained(next);
        if (squares > most) most = squares, best = next, better = true;
      }
      if (!better) step /= 2.0;
    }
    return best;
  }

  std::vector<Beyond> each_;
  double length_s_{};
  double period_s_{};
  bool complete_{};
};

}  // namespace

Eigen::MatrixX4d ContactRinging::shapes(const ArrayXd& since) const {
  const ArrayXd s = since.max(0.0);
  const ArrayXd left = (-decay * s).exp();
  Eigen::MatrixX4d columns{since.size(), 4};
  columns << left * (w * s).cos(), left * (w * s).sin(), w * s * left * (w * s).cos(), w * s * left * (w * s).sin();
  return columns;
}

std::optional<ContactRinging> contactRinging(std::span<const DrivenContact> contacts, double tau_s) {
  return Contacts{contacts, tau_s}.ringing();
}

Signal withoutContactRinging(const DrivenContact& contact, const ContactRinging& ringing,
                             const Eigen::Vector2d& amplitude) {
  Signal signal = *contact.probe;
  for (std::size_t k = 0; k < signal.times.size(); ++k) {
    if (signal.times[k] < contact.from || signal.times[k] > contact.until) continue;
    const ArrayXd since = ArrayXd::Constant(1, signal.times[k] - contact.from);
    signal.values[k] -= (ringing.shapes(since).leftCols<2>() * amplitude).value();
  }
  return signal;
}

}  // namespace probebox::metrology
