#include "tools/probebox/text/progress_bar.hpp"

#include <algorithm>

#include "tools/probebox/text/report.hpp"

namespace probebox::command {

std::string progressBar(std::uint64_t done, std::uint64_t all) {
  if (all == 0) return printed("%.1f MB", static_cast<double>(done) * 1e-6);
  constexpr std::size_t kWidth = 20;
  const double share = std::min(static_cast<double>(done) / static_cast<double>(all), 1.0);
  const auto full = static_cast<std::size_t>(share * kWidth);
  return "[" + std::string(full, '#') + std::string(kWidth - full, '-') + printed("] %3.0f %%", 100 * share);
}

}  // namespace probebox::command
