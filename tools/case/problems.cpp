#include "tools/case/problems.hpp"

#include <algorithm>
#include <cstddef>

namespace probebox::casefolder {
namespace {

constexpr std::size_t kMostTold = 20;

std::string inLines(const std::vector<std::string>& reasons) {
  std::string text;
  for (std::size_t k = 0; k < std::min(reasons.size(), kMostTold); ++k) text += (k == 0 ? "" : "\n  ") + reasons[k];
  if (reasons.size() > kMostTold) text += "\n  and more, of which these are the first";
  return text;
}

}  // namespace

Problem Problems::problem(const std::string& method) const {
  std::vector<std::string> reasons = unreadable_;
  for (const auto& refusal : refusals_) {
    const bool first = reasons.empty();
    reasons.push_back(first ? refusal.reason : refusal.name + ": " + refusal.reason);
  }
  if (!unreadable_.empty()) return Unreadable{inLines(reasons)};
  return Unsupported{method, {refusals_.front().name, inLines(reasons)}};
}

}  // namespace probebox::casefolder
