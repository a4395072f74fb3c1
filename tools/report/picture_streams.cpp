#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>

#include "firmware/metrology/dataset/quantity.hpp"
#include "tools/report/pictures.hpp"
#include "tools/report/two_streams.hpp"

namespace probebox::report {
namespace {

namespace quantity = metrology::quantity;

constexpr double kInContact = 0.05;      // of the largest deflection
constexpr double kBesideContact = 0.15;  // of its length, that is shown before and after
constexpr double kAroundStep_s = 0.08;

// The probe as the machine would be where the tip sticks: offset - gain * deflection.
struct Likeness {
  double gain{};
  double offset{};
};

struct Window {
  double from{};
  double until{};
};

// By how much the machine's stamps are still late: a previous delay is out of them already.
double delayAlong(const TwoStreams& streams, const metrology::Result& result) {
  const auto left = [&](std::string_view key) {
    const auto* residual = result.find("residual_" + std::string{key});
    return residual != nullptr ? residual : result.find(key);
  };
  if (const auto* tau = left(quantity::kTau.key)) return tau->value();
  const auto* axes = left(quantity::kTauAxis.key);
  double tau = 0.0;
  for (std::size_t k = 0; axes != nullptr && k < std::min<std::size_t>(3, axes->values.size()); ++k) {
    tau += streams.axis_share[k] * axes->values[k];
  }
  return tau;
}

// In the window alone: around a whole scan the middle of the sphere that is a little off bends one of the two.
std::optional<Likeness> likenessOf(const TwoStreams& streams, double tau, const Window& window) {
  const double limit = streams.whole_contact ? kInContact * *std::ranges::max_element(streams.probe) : -1.0;
  double n = 0.0;
  double sd = 0.0;
  double sq = 0.0;
  double sdd = 0.0;
  double sdq = 0.0;
  for (std::size_t k = 0; k < streams.probe_s.size(); ++k) {
    const auto q = valueAt(streams.machine_s, streams.machine_mm, streams.probe_s[k] + tau);
    const double d = streams.probe[k];
    if (!q || d < limit || streams.probe_s[k] < window.from || streams.probe_s[k] > window.until) continue;
    n += 1.0, sd += d, sq += *q, sdd += d * d, sdq += d * *q;
  }
  const double determinant = n * sdd - sd * sd;
  if (n < 3.0 || !(determinant > 0.0)) return std::nullopt;
  const double slope = (n * sdq - sd * sq) / determinant;
  return Likeness{-slope, (sq - slope * sd) / n};
}

// The contact with something beside it; of a scan what lies around its steepest step.
Window windowOf(const TwoStreams& streams) {
  if (!streams.whole_contact) {
    std::size_t steepest = 1;
    for (std::size_t k = 1; k < streams.machine_mm.size(); ++k) {
      const auto step = [&](std::size_t at) { return std::abs(streams.machine_mm[at] - streams.machine_mm[at - 1]); };
      if (step(k) > step(steepest)) steepest = k;
    }
    const double middle = streams.machine_s[steepest];
    return {middle - kAroundStep_s, middle + kAroundStep_s};
  }
  const double limit = kInContact * *std::ranges::max_element(streams.probe);
  Window window{streams.probe_s.back(), streams.probe_s.front()};
  for (std::size_t k = 0; k < streams.probe_s.size(); ++k) {
    if (streams.probe[k] < limit) continue;
    window.from = std::min(window.from, streams.probe_s[k]);
    window.until = std::max(window.until, streams.probe_s[k]);
  }
  const double beside = kBesideContact * (window.until - window.from);
  return {window.from - beside, window.until + beside};
}

// Both streams against time from the start of the window; `taken_out` is subtracted from the machine's stamps.
Plot drawn(const TwoStreams& streams, const Window& window, const Likeness& likeness, double taken_out,
           const std::string& title) {
  const bool touch = streams.whole_contact;
  Plot plot{title + ", " + streams.name, "time (ms)", touch ? "along the retract (mm)" : "radius (mm)"};
  const double level = touch ? likeness.offset : 0.0;
  std::vector<Point> machine;
  for (std::size_t k = 0; k < streams.machine_s.size(); ++k) {
    const double t = streams.machine_s[k] - taken_out;
    if (t >= window.from && t <= window.until)
      machine.push_back({1e3 * (t - window.from), streams.machine_mm[k] - level});
  }
  std::vector<Point> probe;
  for (std::size_t k = 0; k < streams.probe_s.size(); ++k) {
    const double t = streams.probe_s[k];
    const double seen = likeness.offset - likeness.gain * streams.probe[k] - level;
    if (t >= window.from && t <= window.until) probe.push_back({1e3 * (t - window.from), seen});
  }
  plot.add(std::move(machine), Look::solid, "machine");
  plot.add(std::move(probe), Look::dashed, "probe, times its gain and turned over");
  return plot;
}

}  // namespace

std::vector<Plot> streamPictures(const metrology::Dataset& dataset, const metrology::Result& result) {
  const auto streams = twoStreams(dataset);
  if (!streams || (result.find(quantity::kTau.key) == nullptr && result.find(quantity::kTauAxis.key) == nullptr))
    return {};
  const double tau = delayAlong(*streams, result);
  const Window window = windowOf(*streams);
  const auto likeness = likenessOf(*streams, tau, window);
  if (!likeness) return {};
  return {drawn(*streams, window, *likeness, 0.0, "As stamped"),
          drawn(*streams, window, *likeness, tau, "Delay taken out")};
}

std::vector<Plot> rawStreamPictures(const metrology::Dataset& dataset) {
  const auto streams = twoStreams(dataset);
  if (!streams) return {};
  const double start = std::min(streams->machine_s.front(), streams->probe_s.front());
  Plot machine{"Machine as stamped, " + streams->name, "time (ms)", "along the retract (mm)"};
  Plot probe{"Probe as stamped, " + streams->name, "time (ms)", "deflection (units of the probe)"};
  std::vector<Point> of_machine;
  std::vector<Point> of_probe;
  for (std::size_t k = 0; k < streams->machine_s.size(); ++k) {
    of_machine.push_back({1e3 * (streams->machine_s[k] - start), streams->machine_mm[k]});
  }
  for (std::size_t k = 0; k < streams->probe_s.size(); ++k) {
    of_probe.push_back({1e3 * (streams->probe_s[k] - start), streams->probe[k]});
  }
  machine.add(std::move(of_machine), Look::solid);
  probe.add(std::move(of_probe), Look::dashed);
  return {machine, probe};
}

}  // namespace probebox::report
