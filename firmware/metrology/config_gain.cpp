#include "firmware/metrology/config_gain.hpp"

#include <algorithm>
#include <cmath>
#include <variant>
#include <vector>

namespace probebox::metrology {

Outcome<Eigen::Matrix3d, Refusal> configGain(const Dataset& dataset) {
  const auto entry = dataset.config.find("gain_matrix");
  if (entry == dataset.config.end()) return Eigen::Matrix3d{Eigen::Matrix3d::Identity()};
  const auto* rows = std::get_if<Matrix>(&entry->second);
  const auto three = [](const std::vector<double>& row) {
    return row.size() == 3 && std::ranges::all_of(row, [](double value) { return std::isfinite(value); });
  };
  if (!rows || rows->size() != 3 || !std::ranges::all_of(*rows, three)) {
    return Refusal{"bad-config", "config key 'gain_matrix' must be three rows of three finite numbers"};
  }
  Eigen::Matrix3d gain;
  for (Eigen::Index i = 0; i < 3; ++i)
    gain.row(i) = Eigen::RowVector3d::Map((*rows)[static_cast<std::size_t>(i)].data());
  return gain;
}

}  // namespace probebox::metrology
