#include "firmware/metrology/dataset/result.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "firmware/metrology/dataset/estimate.hpp"

namespace probebox::metrology {

const Estimate* Result::find(std::string_view key) const {
  for (const auto* list : {&estimates, &also}) {
    const auto found = std::ranges::find(*list, key, &Estimate::key);
    if (found != list->end()) return &*found;
  }
  return nullptr;
}

std::optional<double> Result::designFigure() const {
  if (estimates.empty() || estimates.front().design.empty()) return std::nullopt;
  const auto part = partsOf(estimates.front()).front();
  double squares = 0.0;
  for (const auto k : part.at) squares += estimates.front().design[k] * estimates.front().design[k];
  return std::sqrt(squares / static_cast<double>(part.at.size()));
}

}  // namespace probebox::metrology
