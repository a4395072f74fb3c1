#include "firmware/metrology/dataset/stamp_digits.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/dataset/stamp_ticks.hpp"

namespace probebox::metrology {
namespace {

constexpr double kFinest_s = 1e-6;
constexpr std::array<std::string_view, 3> kStreams{"machine", "probe", "article"};

bool isMultiple(double time_s, double digit_s) {
  const double close_s = 1e-3 * digit_s + std::numeric_limits<double>::epsilon() * std::abs(time_s);
  return std::abs(std::remainder(time_s, digit_s)) <= close_s;
}

}  // namespace

double digitOfTimes(const std::vector<double>& times_s) {
  int places = 0;
  for (const double time_s : times_s) {
    while (places <= 6 && !isMultiple(time_s, std::pow(10.0, -places))) ++places;
    if (places > 6) return 0;
  }
  return std::pow(10.0, -places);
}

double CoarseStamps::sd_s() const {
  return digit_s / std::sqrt(12.0);
}

std::vector<CoarseStamps> coarseStamps(const Dataset& dataset) {
  std::vector<CoarseStamps> coarse;
  std::vector<StampTicks> ticks;
  for (const auto name : kStreams) {
    const Table* table = dataset.table(name);
    const auto* times_s = table != nullptr ? table->column(column::kTime) : nullptr;
    if (times_s == nullptr || times_s->empty()) continue;
    coarse.push_back({std::string{name}, digitOfTimes(*times_s)});
    ticks.push_back(ticksOf(*table));
  }
  // A steady rate of one tick a sample is one of the clock where that is shown by another stream.
  const auto of_clock = [&](double tick_s) {
    return std::ranges::any_of(
        ticks, [&](const StampTicks& other) { return other.shown && std::abs(other.tick_s - tick_s) < 1e-3 * tick_s; });
  };
  for (std::size_t k = 0; k < coarse.size(); ++k) {
    coarse[k].ticks = ticks[k].tick_s > 1.5 * coarse[k].digit_s && of_clock(ticks[k].tick_s);
    if (coarse[k].ticks) coarse[k].digit_s = ticks[k].tick_s;
    if (coarse[k].digit_s < 1.5 * kFinest_s) return {};
  }
  return coarse;
}

std::string sentenceOf(const CoarseStamps& stamps) {
  return "the stamps t_s of table '" + stamps.table + "' " + (stamps.ticks ? "come in ticks of " : "have digits of ") +
         text(stamps.digit_s) + " s: what rounding leaves of a delay, up to " + text(stamps.digit_s / 2) +
         " s, is in the standard deviations; record microseconds";
}

}  // namespace probebox::metrology
