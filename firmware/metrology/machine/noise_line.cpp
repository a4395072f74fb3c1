#include "firmware/metrology/machine/noise_line.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numeric>

#include "firmware/metrology/fit/robust_statistics.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::metrology {
namespace {

constexpr std::size_t kFewestWindows = 3, kFewestSamples = 8;
constexpr double kStepsPerWidth = 4.0;   // of the grid of frequencies, in one over the length of a window
constexpr double kStandsOut_sd = 8.0;    // of what noise explains at one frequency; some hundred are looked at
constexpr double kOverNeighbours = 1.7;  // a line is narrow, coloured noise is not
constexpr double kOneSine = 0.01;        // of n^2: below it sine and cosine of a window are one
constexpr double kParts = 6.0;           // sine and cosine of three components

// What a sine explains of the windows.
struct Explained {
  double squares{};                  // mm^2
  std::vector<double> ofOne;         // squared amplitude of each window, what noise makes of it not taken out
  std::vector<double> per_variance;  // of that, for noise of variance 1
};

class Windows {
 public:
  explicit Windows(std::span<const StillWindow> all) {
    for (const auto& one : all) {
      if (one.times.size() < kFewestSamples) continue;
      Centred window{one.times, one.values.rowwise() - one.values.colwise().mean()};
      squares_ += window.values.squaredNorm();
      samples_ += static_cast<double>(one.times.size());
      lasts_ += one.times.back() - one.times.front();
      windows_.push_back(std::move(window));
    }
    if (windows_.empty()) return;
    lasts_ /= static_cast<double>(windows_.size());
    // The mean over the steps of one period: a lost sample makes one of two.
    std::vector<double> steps;
    for (const auto& window : windows_)
      for (std::size_t k = 1; k < window.times.size(); ++k) steps.push_back(window.times[k] - window.times[k - 1]);
    const double usual = median(steps);
    std::erase_if(steps, [&](double step) { return step > 1.5 * usual; });
    period_ = std::accumulate(steps.begin(), steps.end(), 0.0) / static_cast<double>(steps.size());
  }

  double count() const { return static_cast<double>(windows_.size()); }
  double lasts_s() const { return lasts_; }
  double rate_hz() const { return 1.0 / period_; }
  // Of one component of a sample, a sine taken out.
  double varianceWithout(double explained) const { return (squares_ - explained) / (3.0 * (samples_ - 3.0 * count())); }

  Explained at(double frequency_hz) const {
    Explained found;
    const double turn = kTurn * frequency_hz * period_;
    const std::complex<double> step = std::polar(1.0, turn);
    for (const auto& [times, values] : windows_) {
      const auto n = static_cast<double>(times.size());
      double c = 0, s = 0, cc = 0, cs = 0;
      Eigen::RowVector3d by_c = Eigen::RowVector3d::Zero(), by_s = Eigen::RowVector3d::Zero();
      std::complex<double> now = 1.0;
      double index = 0;
      for (std::size_t k = 0; k < times.size(); ++k) {
        const double wanted = std::round((times[k] - times.front()) / period_);  // lost samples are stepped over
        if (wanted - index > 8) now = std::polar(1.0, turn * wanted), index = wanted;
        for (; index < wanted; ++index) now *= step;
        c += now.real(), s += now.imag(), cc += now.real() * now.real(), cs += now.real() * now.imag();
        by_c += now.real() * values.row(static_cast<Eigen::Index>(k));
        by_s += now.imag() * values.row(static_cast<Eigen::Index>(k));
      }
      const double ss = n - cc - s * s / n;  // about the mean
      cc -= c * c / n, cs -= c * s / n;
      const double determinant = cc * ss - cs * cs;
      if (determinant < kOneSine * n * n) {
        found.ofOne.push_back(0), found.per_variance.push_back(0);
        continue;
      }
      const Eigen::RowVector3d cosine = (ss * by_c - cs * by_s) / determinant;
      const Eigen::RowVector3d sine = (cc * by_s - cs * by_c) / determinant;
      found.squares += cosine.dot(by_c) + sine.dot(by_s);
      found.ofOne.push_back(cosine.squaredNorm() + sine.squaredNorm());
      found.per_variance.push_back(3.0 * (cc + ss) / determinant);
    }
    return found;
  }

 private:
  struct Centred {
    std::vector<double> times;
    Rows3 values;
  };
  std::vector<Centred> windows_;
  double squares_{}, samples_{}, lasts_{}, period_{};
};

}  // namespace

std::optional<NoiseAtRest> noiseAtRest(std::span<const StillWindow> windows) {
  std::vector<std::pair<Eigen::Vector3d, double>> of_each;  // squares and their degrees of freedom
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();
  double dof = 0;
  for (const auto& one : windows) {
    if (one.times.size() < 2) continue;
    const Rows3 off = one.values.rowwise() - one.values.colwise().mean();
    of_each.emplace_back(off.colwise().squaredNorm().transpose(), static_cast<double>(one.times.size()) - 1);
    squares += of_each.back().first;
    dof += of_each.back().second;
  }
  if (of_each.size() < kFewestWindows) return std::nullopt;
  const Eigen::Vector3d variance = squares / dof;
  Eigen::Vector3d scatter = Eigen::Vector3d::Zero();
  for (const auto& [own, own_dof] : of_each) scatter += (own - own_dof * variance).cwiseAbs2();
  const auto count = static_cast<double>(of_each.size());
  const Eigen::Vector3d sd_variance = (scatter * count / (count - 1)).cwiseSqrt() / dof;
  NoiseAtRest noise{variance.cwiseSqrt(), Eigen::Vector3d::Zero()};
  for (Eigen::Index k = 0; k < 3; ++k)
    if (noise.sd_mm[k] > 0) noise.sd_of_sd_mm[k] = sd_variance[k] / (2 * noise.sd_mm[k]);
  return noise;
}

std::optional<NoiseLine> noiseLine(std::span<const StillWindow> all) {
  const Windows windows{all};
  if (windows.count() < static_cast<double>(kFewestWindows)) return std::nullopt;
  const double width = 1.0 / windows.lasts_s(), step = width / kStepsPerWidth;
  std::vector<double> power;
  for (double f = width; f < 0.5 * windows.rate_hz() - step; f += step) power.push_back(windows.at(f).squares);
  if (power.size() < 3) return std::nullopt;
  const auto best = static_cast<std::size_t>(std::ranges::max_element(power) - power.begin());
  // Noise explains a part of each window that has as many sd as degrees of freedom.
  const double variance = windows.varianceWithout(power[best]), parts = kParts * windows.count();
  if (power[best] < variance * (parts + kStandsOut_sd * std::sqrt(2.0 * parts))) return std::nullopt;
  const auto beside = [&](std::size_t k) {
    const auto away = best > k ? best - k : k - best;
    return away > 2 * static_cast<std::size_t>(kStepsPerWidth) && away < 6 * static_cast<std::size_t>(kStepsPerWidth);
  };
  std::vector<double> around;
  for (std::size_t k = 0; k < power.size(); ++k)
    if (beside(k)) around.push_back(power[k]);
  if (!around.empty()) {
    std::ranges::nth_element(around, around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2));
    if (power[best] < kOverNeighbours * around[around.size() / 2]) return std::nullopt;
  }
  // The top of a parabola, twice: the second is narrow.
  double frequency = width + step * static_cast<double>(best), curvature = 0;
  for (const double reach : {step, step / 4}) {
    const double low = windows.at(frequency - reach).squares, middle = windows.at(frequency).squares,
                 high = windows.at(frequency + reach).squares;
    curvature = (2 * middle - low - high) / (reach * reach);
    if (curvature > 0) frequency += std::clamp(0.5 * (high - low) / (curvature * reach), -reach, reach);
  }
  if (!(curvature > 0)) return std::nullopt;
  const Explained there = windows.at(frequency);
  const double left = windows.varianceWithout(there.squares);
  double sum = 0, squares = 0;
  for (std::size_t k = 0; k < there.ofOne.size(); ++k) {
    const double own = there.ofOne[k] - left * there.per_variance[k];
    sum += own;
    squares += own * own;
  }
  const double mean = sum / windows.count();
  if (!(mean > 0)) return std::nullopt;
  const double of_mean = std::sqrt((squares / windows.count() - mean * mean) / (windows.count() - 1));
  const double amplitude = std::sqrt(mean);
  return NoiseLine{frequency, std::sqrt(2.0 * left / curvature), amplitude, of_mean / (2 * amplitude),
                   windows.rate_hz()};
}

}  // namespace probebox::metrology
