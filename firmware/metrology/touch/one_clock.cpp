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

std::optional<Refusal> clocksDiffer(const Touch& touch, const Retract& retract, const AlongDelay& delay) {
  const Stream machine = withoutSpikes(touch.machine, 0.0).stream;
  const Stream probe = withoutSpikes(touch.probe, 0.0).stream;
  const Signal place{machine.times, machine.along(touch.plan.retract, {0, machine.times.size()})};
  const Eigen::Vector3d apex = retract.probe_apex;
  const auto stay =
      stayAbove({probe.times, probe.along(apex / apex.squaredNorm(), {0, probe.times.size()})}, kLevelOfRest);
  if (!stay) return std::nullopt;
  const auto in = passingAt(place, stay->from_s + delay.tau_s);
  const auto out = passingAt(place, stay->until_s + delay.tau_s);
  const double speed = retract.machine.slope.norm();
  if (!in || !out || in->rate > -kLeastApproach * speed || out->rate <= 0.0) return std::nullopt;
  const double falling = retract.probe.slope.norm();
  const double of_probe_s = noiseOf(probe, apex.normalized()) / falling * speed;
  const double still_mm = noiseOf(machine, touch.plan.retract);
  const double rates = out->rate - in->rate;
  const double sd = std::hypot(std::sqrt(2.0) * still_mm, std::sqrt(2.0) * of_probe_s, delay.sd_s * rates);
  const double apart = in->value - out->value;
  const double allowed =
      kApartDeviations * sd + kApartShare * speed * apex.norm() / falling + kApartPeriods * place.period() * rates;
  if (std::abs(apart) <= allowed) return std::nullopt;
  return Refusal{"clocks-differ",
                 touch.plan.name + ": by the delay that was found the machine stands " + text(std::abs(apart)) +
                     " mm apart where the deflection rises and where it falls through the same level; check that "
                     "machine and probe have stamps of one clock, and the stated size"};
}

}  // namespace probebox::metrology
