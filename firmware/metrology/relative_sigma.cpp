#include "firmware/metrology/shank_sigma.hpp"

namespace probebox::metrology {

Outcome<ShankSigma, Refusal> shankSigma(const Dataset& dataset, const Sigma& of_tip) {
  const auto stated = configPositive(dataset, "sigma_shank_mm");
  if (!stated) return stated.error();
  if (!stated.value()) return ShankSigma{};
  if (!of_tip.stated) return ShankSigma{1.0, {"sigma_shank_mm is not used: it needs sigma_mm beside it"}};
  return ShankSigma{*stated.value() / of_tip.value, {}};
}

}  // namespace probebox::metrology
