#include "firmware/metrology/dataset/configured_gain.hpp"

#include "firmware/metrology/dataset/configuration.hpp"

namespace probebox::metrology {

Outcome<Eigen::Matrix3d, Refusal> configGain(const Dataset& dataset, std::string_view key) {
  TRY(const auto rows, configMatrix(dataset, key, 3, 3));
  Eigen::Matrix3d gain = Eigen::Matrix3d::Identity();
  for (Eigen::Index i = 0; rows && i < 3; ++i) {
    gain.row(i) = Eigen::RowVector3d::Map((*rows)[static_cast<std::size_t>(i)].data());
  }
  return gain;
}

}  // namespace probebox::metrology
