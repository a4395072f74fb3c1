#include "firmware/metrology/dataset/relative_sigma.hpp"

namespace probebox::metrology {

Outcome<RelativeSigma, Refusal> relativeSigma(const Dataset& dataset, std::string_view key, const Sigma& usual) {
  TRY(const auto stated, configPositive(dataset, key));
  if (!stated) return RelativeSigma{};
  if (!usual.stated) return RelativeSigma{1.0, {std::string{key} + " is not used: it also needs sigma_mm"}};
  return RelativeSigma{*stated / usual.value, {}};
}

}  // namespace probebox::metrology
