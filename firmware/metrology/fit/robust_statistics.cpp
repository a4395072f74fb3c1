#include "firmware/metrology/fit/robust_statistics.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>

namespace probebox::metrology {
namespace {

// Squared distance of sample k from the polynomial through its neighbours, divided by its expectation at unit variance.
double missedSquare(const Signal& signal, std::size_t k, std::span<const std::size_t> neighbours) {
  double missed = signal.values[k];
  double variance = 1.0;
  for (const auto i : neighbours) {
    double weight = 1.0;
    const double t_i = signal.times[k + i - 2];
    for (const auto j : neighbours) {
      if (i == j) continue;
      const double t_j = signal.times[k + j - 2];
      weight *= (signal.times[k] - t_j) / (t_i - t_j);
    }
    missed -= weight * signal.values[k + i - 2];
    variance += weight * weight;
  }
  return missed * missed / variance;
}

}  // namespace

std::size_t strideOf(std::size_t size) {
  constexpr std::size_t kLooks = 4000;
  return 1 + size / kLooks;
}

double median(std::vector<double>& values) {
  // A NaN would leave nth_element without an order.
  const bool none = values.empty() || std::ranges::any_of(values, [](double value) { return std::isnan(value); });
  if (none) return std::numeric_limits<double>::quiet_NaN();
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double Signal::period() const {
  std::vector<double> apart;
  for (std::size_t k = 1; k < times.size(); k += strideOf(times.size())) apart.push_back(times[k] - times[k - 1]);
  return apart.empty() ? 0.0 : median(apart);
}

double sampleVariance(const Signal& signal, Interpolation interpolation) {
  constexpr std::array<std::size_t, 4> kNeighbours{0, 1, 3, 4};  // of 2
  const std::span all{kNeighbours};
  const auto neighbours = interpolation == Interpolation::cubic ? all : all.subspan(1, 2);
  const std::size_t stride = strideOf(signal.times.size());
  std::vector<double> squares;
  for (std::size_t k = 2; k + 2 < signal.times.size(); k += stride)
    squares.push_back(missedSquare(signal, k, neighbours));
  if (squares.empty()) return 0.0;
  const double limit = 16.0 * 2.198 * median(squares);  // four deviations
  double total = 0.0;
  double count = 0.0;
  for (const double square : squares) {
    if (square <= limit) total += square, ++count;
  }
  return total / count;
}

double smallerVariance(const Signal& signal) {
  // Neighbours share samples: the differences are worth half their number. So few are spread as Student's.
  const double dof = static_cast<double>(signal.times.size()) / 2.0;
  const double spread = dof > 3.0 ? dof / (dof - 2.0) : 3.0;
  return spread * std::min(sampleVariance(signal, Interpolation::linear), sampleVariance(signal, Interpolation::cubic));
}

double between(const std::vector<double>& times, const std::vector<double>& values, double t, std::size_t& cursor) {
  while (cursor > 0 && times[cursor] > t) --cursor;
  while (cursor + 2 < times.size() && times[cursor + 1] <= t) ++cursor;
  const double share = (t - times[cursor]) / (times[cursor + 1] - times[cursor]);
  return values[cursor] + std::clamp(share, 0.0, 1.0) * (values[cursor + 1] - values[cursor]);
}

Eigen::VectorXd boxed(const Eigen::VectorXd& values, Eigen::Index half) {
  const Eigen::Index n = values.size();
  Eigen::VectorXd means{n};
  Eigen::Index begin = 0;
  Eigen::Index end = 0;
  double sum = 0.0;
  const auto near_an_end = [&](Eigen::Index k) {
    while (end < n && end <= k + half) sum += values[end++];
    while (begin < k - half) sum -= values[begin++];
    means[k] = sum / static_cast<double>(end - begin);
  };
  const Eigen::Index whole_until = std::max(n - half, half + 1);
  for (Eigen::Index k = 0; k < std::min(half + 1, n); ++k) near_an_end(k);
  // Away from the ends one value comes and one goes: this is most of a long record, and without a division.
  const double share = 1.0 / static_cast<double>(2 * half + 1);
  for (Eigen::Index k = half + 1; k < whole_until; ++k) {
    sum += values[end++] - values[begin++];
    means[k] = sum * share;
  }
  for (Eigen::Index k = whole_until; k < n; ++k) near_an_end(k);
  return means;
}

Interpolant::Interpolant(const Signal& signal, Interpolation interpolation)
    : times_{&signal.times}, interpolation_{interpolation}, gap_{kGapPeriods * signal.period()} {
  pieces_.reserve(signal.times.size());
  for (std::size_t k = 0; k + 1 < signal.times.size(); ++k) pieces_.push_back(pieceAt(signal, k));
}

bool Interpolant::isWide(std::size_t interval) const {
  if (interpolation_ == Interpolation::linear || interval == 0 || interval + 2 >= times_->size()) return false;
  return (*times_)[interval + 1] - (*times_)[interval] <= gap_;
}

// Newton's divided differences about the first stamp of the interval, taken in the order 0, 1, -1, 2.
Interpolant::Piece Interpolant::pieceAt(const Signal& signal, std::size_t interval) const {
  const auto& t = signal.times;
  const auto& v = signal.values;
  const std::size_t k = interval;
  const double b = t[k + 1] - t[k];
  const double first = (v[k + 1] - v[k]) / b;
  if (!isWide(k)) return {t[k], {v[k], first, 0.0, 0.0}};
  const double a = t[k - 1] - t[k];
  const double c = t[k + 2] - t[k];
  const double second = ((v[k - 1] - v[k]) / a - first) / (a - b);
  const double second_ahead = ((v[k + 2] - v[k]) / c - first) / (c - b);
  const double third = (second_ahead - second) / (c - a);
  return {t[k], {v[k], first - second * b + third * a * b, second - third * (a + b), third}};
}

void Interpolant::advance(double t, std::size_t& cursor) const {
  while (cursor > 0 && pieces_[cursor].from > t) --cursor;
  while (cursor + 1 < pieces_.size() && pieces_[cursor + 1].from <= t) ++cursor;
}

Interpolant::Sample Interpolant::at(double t, std::size_t& cursor) const {
  advance(t, cursor);
  const Piece& piece = pieces_[cursor];
  const auto& p = piece.powers;
  const double since = t - piece.from;
  return {p[0] + since * (p[1] + since * (p[2] + since * p[3])), p[1] + since * (2.0 * p[2] + since * 3.0 * p[3])};
}

Interpolant::Stencil Interpolant::stencilAt(double t, std::size_t& cursor) const {
  advance(t, cursor);
  const auto& times = *times_;
  Stencil stencil;
  const bool wide = isWide(cursor);
  stencil.first = wide ? cursor - 1 : cursor;
  stencil.count = wide ? 4 : 2;
  for (std::size_t i = 0; i < stencil.count; ++i) {
    double above = 1.0;
    double below = 1.0;
    for (std::size_t j = 0; j < stencil.count; ++j) {
      if (j == i) continue;
      above *= t - times[stencil.first + j];
      below *= times[stencil.first + i] - times[stencil.first + j];
    }
    stencil.weights[i] = above / below;
  }
  return stencil;
}

void Interpolant::addGains(double t, double weight, std::size_t& cursor, Eigen::VectorXd& gains) const {
  const Stencil stencil = stencilAt(t, cursor);
  for (std::size_t i = 0; i < stencil.count; ++i) {
    gains[static_cast<Eigen::Index>(stencil.first + i)] += weight * stencil.weights[i];
  }
}

double Interpolant::varianceAt(double t, std::size_t& cursor) const {
  double variance = 0.0;
  for (const double weight : stencilAt(t, cursor).weights) variance += weight * weight;
  return variance;
}

}  // namespace probebox::metrology
