#include "firmware/metrology/touch/previous_delay.hpp"

#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {

std::string_view previousDelayKey(Eigen::Index count) {
  return count == 1 ? "previous_tau_s" : "previous_tau_axis_s";
}

Outcome<Eigen::VectorXd, Refusal> previousDelay(const Dataset& dataset, std::string_view key, Eigen::Index count) {
  if (key == previousDelayKey(1)) {
    TRY(const auto one, configNumber(dataset, key));
    return Eigen::VectorXd{Eigen::VectorXd::Constant(1, one.value_or(0.0))};
  }
  TRY(const auto several, configMatrix(dataset, key, 1, static_cast<std::size_t>(count)));
  if (!several) return Eigen::VectorXd{Eigen::VectorXd::Zero(count)};
  return Eigen::VectorXd{Eigen::VectorXd::Map(several->front().data(), count)};
}

Outcome<Eigen::VectorXd, Refusal> previousDelay(const Dataset& dataset, Eigen::Index count) {
  return previousDelay(dataset, previousDelayKey(count), count);
}

void addResidualDelay(Result& result, const Estimate& whole, const Eigen::VectorXd& previous) {
  if (previous.isZero(0.0)) return;
  Estimate residual = whole;
  residual.key = "residual_" + whole.key;
  for (std::size_t k = 0; k < residual.values.size(); ++k) {
    residual.values[k] -= previous[static_cast<Eigen::Index>(k)];
  }
  result.also.push_back(std::move(residual));
}

}  // namespace probebox::metrology
