#include "firmware/metrology/dataset/relative_sigma.hpp"

namespace probebox::metrology {

Outcome<RelativeSigma, Refusal> relativeSigma(const Dataset& dataset, std::string_view key, const Sigma& usual) {
  const auto stated = configPositive(dataset, key);
  if (!stated) return stated.error();
  if (!stated.value()) return RelativeSigma{};
  if (!usual.stated) return RelativeSigma{1.0, {std::string{key} + " is not used: it also needs sigma_mm"}};
  return RelativeSigma{*stated.value() / usual.value, {}};
}

}  // namespace probebox::metrology
