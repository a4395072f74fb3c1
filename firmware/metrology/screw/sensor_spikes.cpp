#include "firmware/metrology/screw/sensor_spikes.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "firmware/metrology/dataset/digits.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"

namespace probebox::metrology {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kDeviations = 4.5;  // as in scans
constexpr double kDigits = 2.0;
constexpr double kMostShare = 0.02;  // of the rows
constexpr int kMostRounds = 10;

double finestDigit(const VectorXd& values) {
  double digit = 1.0;
  for (const double value : values) digit = std::min(digit, digitOf(value));
  return digit;
}

// Largest residual of every group beyond the limit, of those in use. Rows, in no order.
std::vector<std::size_t> worstRows(const VectorXd& residuals, const std::vector<bool>& in_use,
                                   const std::vector<std::size_t>& group, double digit) {
  std::vector<double> sizes;
  for (std::size_t row = 0; row < in_use.size(); ++row)
    if (in_use[row]) sizes.push_back(std::abs(residuals[static_cast<Index>(row)]));
  const double limit = std::max(kDeviations * 1.4826 * median(sizes), kDigits * digit);
  std::map<std::size_t, std::pair<double, std::size_t>> worst;
  for (std::size_t row = 0; row < in_use.size(); ++row) {
    const double size = std::abs(residuals[static_cast<Index>(row)]);
    if (!in_use[row] || size <= limit) continue;
    auto& of_group = worst[group[row]];
    of_group = std::max(of_group, {size, row});
  }
  std::vector<std::size_t> rows;
  for (const auto& [_, found] : worst) rows.push_back(found.second);
  return rows;
}

// Residuals are those of all rows.
Outcome<Fit, Refusal> fitOf(const Eigen::MatrixXd& design, const VectorXd& values, const std::vector<bool>& in_use) {
  std::vector<std::size_t> kept, dropped;
  for (std::size_t row = 0; row < in_use.size(); ++row) (in_use[row] ? kept : dropped).push_back(row);
  TRY(auto fit, linearLeastSquares(design(kept, Eigen::all), values(kept)));
  fit.residuals = design * fit.parameters - values;
  fit.dropped = std::move(dropped);
  return fit;
}

}  // namespace

Outcome<SpikeFreeFit, Refusal> fitWithoutSpikes(const Eigen::MatrixXd& design, const VectorXd& values,
                                                const std::vector<std::size_t>& group) {
  TRY(const auto all, linearLeastSquares(design, values));
  Fit fit = all;
  const double digit = finestDigit(values);
  std::vector<bool> in_use(group.size(), true);
  for (int round = 0;; ++round) {
    const auto worst = worstRows(fit.residuals, in_use, group, digit);
    if (worst.empty()) return SpikeFreeFit{std::move(fit), false};
    const auto dropped = static_cast<double>(fit.dropped.size() + worst.size());
    if (round == kMostRounds || dropped > std::max(1.0, kMostShare * static_cast<double>(group.size())))
      return SpikeFreeFit{all, true};
    for (const auto row : worst) in_use[row] = false;
    auto again = fitOf(design, values, in_use);
    if (!again) return SpikeFreeFit{all, true};
    fit = std::move(again).value();
  }
}

}  // namespace probebox::metrology
