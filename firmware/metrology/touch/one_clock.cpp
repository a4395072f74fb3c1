#include "firmware/metrology/touch/one_clock.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "firmware/metrology/dataset/configuration.hpp"
#include "firmware/metrology/fit/robust_statistics.hpp"
#include "firmware/metrology/touch/despiking.hpp"
#include "firmware/metrology/touch/stamp_jitter.hpp"

namespace probebox::metrology {
namespace {

constexpr double kLevelOfRest = 0.7;  // of the deflection at rest: what bounced at contact has faded
constexpr double kApartDeviations = 5.0;
constexpr double kApartShare = 0.05;     // of the overtravel
constexpr double kApartPeriods = 0.25;   // of the machine's samples: lines between them cut corners
constexpr double kLeastApproach = 0.05;  // of the speed of the retract
constexpr double kOwnShare = 0.02;       // of the overtravel, by which touches of one speed may differ

struct Passing {
  double value{};
  double rate{};  // per s
};

// By a line between the samples beside a time; none beyond the record and across gaps.
std::optional<Passing> passingAt(const Signal& signal, double t) {
  const auto after = std::ranges::upper_bound(signal.times, t) - signal.times.begin();
  if (after == 0 || after == std::ssize(signal.times)) return std::nullopt;
  const auto k = static_cast<std::size_t>(after);
  const double interval = signal.times[k] - signal.times[k - 1];
  if (interval > kGapPeriods * signal.period()) return std::nullopt;
  const double rate = (signal.values[k] - signal.values[k - 1]) / interval;
  return Passing{signal.values[k - 1] + rate * (t - signal.times[k - 1]), rate};
}

// When the deflection rises through the level, and when it falls through it for good.
struct Stay {
  double from_s{};
  double until_s{};
};

std::optional<Stay> stayAbove(const Signal& share, double level) {
  const auto& values = share.values;
  const auto above = [&](double one) { return one >= level; };
  const auto first = static_cast<std::size_t>(std::ranges::find_if(values, above) - values.begin());
  std::size_t last = values.size();
  while (last > 0 && !above(values[last - 1])) --last;
  if (first == 0 || last <= first || last == values.size()) return std::nullopt;
  const auto crossing = [&](std::size_t k) {
    const double way = (level - values[k - 1]) / (values[k] - values[k - 1]);
    return share.times[k - 1] + way * (share.times[k] - share.times[k - 1]);
  };
  const double allowed = kGapPeriods * share.period();
  if (share.times[first] - share.times[first - 1] > allowed || share.times[last] - share.times[last - 1] > allowed)
    return std::nullopt;
  return Stay{crossing(first), crossing(last)};
}

}  // namespace

std::optional<TwoPlaces> twoPlaces(const Touch& touch, const Retract& retract, double tau_s) {
  const Stream machine = withoutSpikes(touch.machine, 0.0).stream;
  const Stream probe = withoutSpikes(touch.probe, 0.0).stream;
  const Signal place{machine.times, machine.along(touch.plan.retract, {0, machine.times.size()})};
  const Eigen::Vector3d apex = retract.probe_apex;
  const auto stay =
      stayAbove({probe.times, probe.along(apex / apex.squaredNorm(), {0, probe.times.size()})}, kLevelOfRest);
  if (!stay) return std::nullopt;
  const auto in = passingAt(place, stay->from_s + tau_s);
  const auto out = passingAt(place, stay->until_s + tau_s);
  const double speed = retract.machine.slope.norm();
  if (!in || !out || in->rate > -kLeastApproach * speed || out->rate <= 0.0) return std::nullopt;
  const double falling = retract.probe.slope.norm();
  const double of_probe_mm = noiseOf(probe, apex.normalized()) / falling * speed;
  const double still_mm = noiseOf(machine, touch.plan.retract);
  return TwoPlaces{.touch = touch.plan.name,
                   .speed_mm_s = touch.plan.speed_mm_s,
                   .apart_mm = in->value - out->value,
                   .noise_mm = std::hypot(std::sqrt(2.0) * still_mm, std::sqrt(2.0) * of_probe_mm),
                   .overtravel_mm = speed * apex.norm() / falling,
                   .mm_per_s = out->rate - in->rate,
                   .period_s = place.period()};
}

std::optional<Refusal> clocksDiffer(const TwoPlaces& places, double sd_delay_s) {
  const double sd = std::hypot(places.noise_mm, sd_delay_s * places.mm_per_s);
  const double allowed =
      kApartDeviations * sd + kApartShare * places.overtravel_mm + kApartPeriods * places.period_s * places.mm_per_s;
  if (std::abs(places.apart_mm) <= allowed) return std::nullopt;
  return Refusal{"clocks-differ",
                 places.touch + ": by the delay that was found the machine stands " + text(std::abs(places.apart_mm)) +
                     " mm apart where the deflection rises and where it falls through the same level; check that "
                     "machine and probe have stamps of one clock, and the stated size"};
}

std::optional<std::string> ownDelays(const std::vector<TwoPlaces>& touches) {
  for (const auto& one : touches) {
    for (const auto& other : touches) {
      if (other.speed_mm_s != one.speed_mm_s) continue;
      const double off_mm = one.apart_mm - other.apart_mm;
      if (off_mm <= kApartDeviations * std::hypot(one.noise_mm, other.noise_mm) + kOwnShare * one.overtravel_mm)
        continue;
      return one.touch + " and " + other.touch + ": by their ways in and out their delays differ by " +
             text(off_mm / one.mm_per_s) +
             " s: check that machine and probe have the same touches and one clock, and that all axes have one delay";
    }
  }
  return std::nullopt;
}

}  // namespace probebox::metrology
