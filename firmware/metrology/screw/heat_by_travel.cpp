#include "firmware/metrology/screw/heat_by_travel.hpp"

#include <Eigen/Core>
#include <algorithm>
#include <cmath>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/least_squares.hpp"
#include "firmware/metrology/screw/screw_config.hpp"

namespace probebox::metrology {
namespace {

using SegmentHeat = std::array<double, TravelHeat::kSegments>;

// Part of each segment that lies between two distances from the fixed bearing, both in segments.
SegmentHeat waysBetween(double from, double to) {
  SegmentHeat ways{};
  const auto [low, high] = std::minmax(from, to);
  for (std::size_t k = 0; k < ways.size(); ++k) {
    const auto begin = static_cast<double>(k);
    ways[k] = std::max(0.0, std::min(high, begin + 1) - std::max(low, begin));
  }
  return ways;
}

double distanceInSegments(const ScrewModel& screw, double position_mm) {
  return std::clamp(std::abs(leverOf(screw, position_mm)), 0.0, 1.0) * TravelHeat::kSegments;
}

double informationOf(double squares, std::size_t readings, double unknowns) {
  const auto count = static_cast<double>(readings);
  return count * std::log(squares / count) + unknowns * std::log(count);
}

}  // namespace

TravelHeat::TravelHeat(const ScrewModel& screw, const std::vector<double>& times_s,
                       const std::vector<double>& positions_mm)
    : screw_{screw}, times_s_{times_s} {
  for (std::size_t k = 1; k < times_s.size(); ++k) {
    auto ways = waysBetween(distanceInSegments(screw, positions_mm[k - 1]), distanceInSegments(screw, positions_mm[k]));
    for (double& way : ways) way *= screw.length_mm / kSegments / (times_s[k] - times_s[k - 1]);
    rate_.push_back(ways);
  }
}

std::vector<SegmentHeat> TravelHeat::smoothed(double time_constant_s, const std::vector<double>& at_s) const {
  std::vector<SegmentHeat> before{SegmentHeat{}};  // at each time of the strokes
  const auto later = [&](const SegmentHeat& heat, const SegmentHeat& rate, double elapsed_s) {
    const double kept = std::exp(-elapsed_s / time_constant_s);
    SegmentHeat found{};
    for (std::size_t k = 0; k < kSegments; ++k) found[k] = heat[k] * kept + rate[k] * (1 - kept);
    return found;
  };
  for (std::size_t k = 0; k < rate_.size(); ++k)
    before.push_back(later(before[k], rate_[k], times_s_[k + 1] - times_s_[k]));
  std::vector<SegmentHeat> found;
  for (const double time_s : at_s) {
    const auto next = std::ranges::upper_bound(times_s_, time_s) - times_s_.begin();
    const auto last = static_cast<std::size_t>(std::max<std::ptrdiff_t>(next - 1, 0));
    const SegmentHeat rate = last < rate_.size() ? rate_[last] : SegmentHeat{};
    found.push_back(later(before[last], rate, std::max(0.0, time_s - times_s_[last])));
  }
  return found;
}

std::optional<Refusal> TravelHeat::validateTimes(const Table& table) const {
  const auto& times = *table.column(column::kReadAt);
  const auto outside =
      std::ranges::find_if(times, [&](double time_s) { return time_s < times_s_.front() || time_s > times_s_.back(); });
  if (outside == times.end()) return std::nullopt;
  return Refusal{"outside-travel", "table '" + table.name + "', row " + std::to_string(outside - times.begin() + 1) +
                                       ": table 'travel' does not say where the nut was at " + text(*outside) +
                                       " s: give its rows from before the first reading to the last, on one clock"};
}

double TravelHeat::shareOf(const SegmentHeat& heat, double position_mm) const {
  constexpr double kWarm_mm_s = 1e-6;  // less is rounding
  const double lever = leverOf(screw_, position_mm);
  const auto ways = waysBetween(0, distanceInSegments(screw_, position_mm));
  double here = 0, all = 0;
  for (std::size_t k = 0; k < kSegments; ++k) {
    here += ways[k] * heat[k];
    all += heat[k];
  }
  return all > kWarm_mm_s ? std::copysign(here / all, lever) : lever;
}

std::vector<double> TravelHeat::sharesOf(Heat fast, const Heat& slow, double ratio,
                                         const std::vector<double>& positions_mm) const {
  std::vector<double> shares;
  for (std::size_t row = 0; row < positions_mm.size(); ++row) {
    for (std::size_t k = 0; k < kSegments; ++k) fast[row][k] += ratio * slow[row][k];
    shares.push_back(shareOf(fast[row], positions_mm[row]));
  }
  return shares;
}

std::vector<double> TravelHeat::sharesOf(const HeatLaw& law, const std::vector<double>& at_s,
                                         const std::vector<double>& positions_mm) const {
  return sharesOf(smoothed(law.time_constant_s[0], at_s), smoothed(law.time_constant_s[1], at_s), law.ratio,
                  positions_mm);
}

Outcome<std::optional<TravelHeat>, Refusal> travelOf(const Dataset& dataset, const ScrewModel& screw) {
  if (dataset.table(kTravel) == nullptr) return std::optional<TravelHeat>{};
  TRY(const auto table, checkedTable(dataset, kTravel, kTravelColumns));
  if (auto refusal = refuseOutside(screw, *table)) return *refusal;
  const auto& times = *table->column(column::kReadAt);
  for (std::size_t row = 1; row < times.size(); ++row) {
    if (times[row] > times[row - 1]) continue;
    return Refusal{"time-not-rising", "table 'travel', row " + std::to_string(row + 1) +
                                          ": its time is not later than that of the row before: give the rows in the "
                                          "order of time"};
  }
  return std::optional{TravelHeat{screw, times, *table->column(column::kX)}};
}

std::optional<TravelGain> gainByTravel(const ScrewModel& screw, const TravelHeat& heat, const std::vector<double>& at_s,
                                       const std::vector<double>& positions_mm,
                                       const std::vector<double>& extensions_um, const std::vector<double>& errors_um,
                                       double squares_of_one) {
  constexpr std::array kTimeConstants_s{100.0, 200.0, 400.0, 800.0, 1600.0, 3200.0, 6400.0, 12800.0};
  constexpr std::array kRatios{0.25, 1.0, 4.0};
  constexpr std::size_t kLeastReadings = 10;
  constexpr double kUnknowns = 5, kStrong = 6;
  const std::size_t count = errors_um.size();
  if (count < kLeastReadings) return std::nullopt;
  std::optional<TravelGain> best;
  std::vector<TravelHeat::Heat> heats;
  for (const double time_constant_s : kTimeConstants_s) heats.push_back(heat.smoothed(time_constant_s, at_s));
  const Eigen::VectorXd errors = Eigen::VectorXd::Map(errors_um.data(), static_cast<Eigen::Index>(count));
  const auto consider = [&](std::size_t fast, std::size_t slow, double ratio) {
    const auto shares = heat.sharesOf(heats[fast], heats[slow], ratio, positions_mm);
    Eigen::MatrixXd design{errors.size(), 2};
    for (std::size_t row = 0; row < count; ++row) {
      const double lever = leverOf(screw, positions_mm[row]);
      design.row(static_cast<Eigen::Index>(row)) << lever * extensions_um[row], shares[row] * extensions_um[row];
    }
    const auto fit = linearLeastSquares(design, errors);
    if (!fit) return;
    const double squares = fit->sumOfSquares();
    if (best && squares >= best->sum_of_squares) return;
    const HeatLaw law{{kTimeConstants_s[fast], kTimeConstants_s[slow]}, ratio};
    const double variance = squares / (static_cast<double>(count) - kUnknowns);
    const Eigen::Vector2d sd = (variance * fit->cofactor.diagonal()).cwiseSqrt();
    best = {fit->parameters[0], fit->parameters[1], sd[0], sd[1], law, squares};
  };
  for (std::size_t fast = 0; fast < heats.size(); ++fast) {
    consider(fast, fast, 0);
    for (std::size_t slow = fast + 1; slow < heats.size(); ++slow)
      for (const double ratio : kRatios) consider(fast, slow, ratio);
  }
  if (!best || !(best->sum_of_squares > 0)) return std::nullopt;
  const bool is_better =
      informationOf(best->sum_of_squares, count, kUnknowns) + kStrong < informationOf(squares_of_one, count, 1);
  return is_better ? best : std::nullopt;
}

}  // namespace probebox::metrology
