#include <algorithm>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <functional>
#include <limits>
#include <random>
#include <span>
#include <vector>

#include "firmware/metrology/solve.hpp"
#include "host-tests/metrology/scan_simulation.hpp"
#include "host-tests/metrology/touch_simulation.hpp"

// Time of a solve, and its ratio to a peer in the same run: absolute times of different machines do not compare.
namespace {

using namespace probebox::metrology;

// Processor time of the best of some runs, ms: others may be using the machine.
double bestOf(int runs, const std::function<void()>& run) {
  double best = std::numeric_limits<double>::infinity();
  for (int i = 0; i < runs; ++i) {
    const std::clock_t start = std::clock();
    run();
    best = std::min(best, static_cast<double>(std::clock() - start) * 1e3 / CLOCKS_PER_SEC);
  }
  return best;
}

std::size_t samplesOf(const Dataset& dataset) {
  return dataset.table("machine")->rows() + dataset.table("probe")->rows();
}

// What one pass over a record costs that does the least: the length of every sample.
double lengths(const Dataset& dataset) {
  double sum = 0.0;
  for (const auto* name : {"machine", "probe"}) {
    const auto& columns = dataset.table(name)->columns;
    for (std::size_t row = 0; row < columns[0].values.size(); ++row) {
      sum += std::hypot(columns[2].values[row], columns[3].values[row], columns[4].values[row]);
    }
  }
  return sum;
}

// The peer: the delay of one scan by trying lags, the deflection interpolated anew for each (A15) without (A17).
double triedLags(const Dataset& dataset, double from, double until, int count) {
  const auto column = [&](const char* table, std::size_t k) -> const std::vector<double>& {
    return dataset.table(table)->columns[k].values;
  };
  const auto& centre = std::get<std::vector<double>>(dataset.config.at("centre_mm"));
  const auto& times = column("machine", 1);
  const auto& stamps = column("probe", 1);
  double best = 0.0;
  double least = std::numeric_limits<double>::infinity();
  for (int lag = 0; lag < count; ++lag) {
    const double tau = from + (until - from) * lag / (count - 1);
    double n = 0.0;
    double sum = 0.0;
    double squares = 0.0;
    std::size_t at = 0;
    for (std::size_t k = 0; k < times.size(); ++k) {
      const double t = times[k] - tau;
      if (k > 0 && times[k] < times[k - 1]) at = k;  // the next scan
      while (at + 1 < stamps.size() && stamps[at + 1] <= t) ++at;
      if (at + 1 >= stamps.size() || t < stamps[at]) continue;
      const double share = (t - stamps[at]) / (stamps[at + 1] - stamps[at]);
      const auto size = [&](std::size_t row) {
        return std::hypot(column("probe", 2)[row], column("probe", 3)[row], column("probe", 4)[row]);
      };
      const double radius = std::hypot(column("machine", 2)[k] - centre[0], column("machine", 3)[k] - centre[1]);
      const double e = radius + (1.0 - share) * size(at) + share * size(at + 1);
      n += 1.0, sum += e, squares += e * e;
    }
    const double scatter = squares / n - sum / n * (sum / n);
    if (scatter < least) least = scatter, best = tau;
  }
  return best;
}

void answered(const Dataset& dataset) {
  if (!solve(dataset).ok()) std::printf("refused\n");
}

void scan() {
  std::mt19937_64 random{1};
  simulation::ScanScene scene;
  scene.machine_rate_hz = 4000.0;
  scene.probe_rate_hz = 8000.0;
  const Dataset dataset = simulation::measure(scene, random);
  const auto solved = solve(dataset);
  const double solve_ms = bestOf(9, [&] { answered(dataset); });
  volatile double kept = 0.0;
  const double pass_ms = bestOf(9, [&] { kept = lengths(dataset); });
  simulation::ScanScene alone = scene;
  alone.speeds_mm_s = {20.0};
  const Dataset one = simulation::measure(alone, random);
  const double one_ms = bestOf(9, [&] { answered(one); });
  const double lags_ms = bestOf(2, [&] { kept = triedLags(one, -0.05, 0.05, 101); });
  std::printf("stepped scan: %zu samples in %.1f ms = %.0f ns a sample = %.0f x the lengths of all samples\n",
              samplesOf(dataset), solve_ms, solve_ms * 1e6 / static_cast<double>(samplesOf(dataset)),
              solve_ms / pass_ms);
  std::printf("  off by %.2f us, sd %.2f us, bound %.2f us\n", (solved->find("tau_s")->value() - scene.tau_s) * 1e6,
              *solved->find("tau_s")->standardDeviation() * 1e6, scene.bound_s() * 1e6);
  std::printf("  one scan: %.1f ms; 101 lags tried, to 1 ms: %.1f ms = %.1f x as long\n", one_ms, lags_ms,
              lags_ms / one_ms);
}

void touches() {
  std::mt19937_64 random{2};
  const simulation::Scene scene;
  const Dataset dataset = simulation::measure(scene, random);
  const double solve_ms = bestOf(9, [&] { answered(dataset); });
  volatile double kept = 0.0;
  const double pass_ms = bestOf(9, [&] { kept = lengths(dataset); });
  std::printf("several speeds: %zu touches, %zu samples in %.1f ms = %.0f x the lengths of all samples\n",
              dataset.table("touches")->rows(), samplesOf(dataset), solve_ms, solve_ms / pass_ms);
}

}  // namespace

int main() {
  scan();
  touches();
}
