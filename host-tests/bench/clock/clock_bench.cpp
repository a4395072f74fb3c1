#include <algorithm>
#include <array>
#include <benchmark/benchmark.h>
#include <cstdio>
#include <ctime>
#include <vector>

#include "firmware/clock/counter_clock.hpp"
#include "firmware/clock/estimator.hpp"
#include "firmware/clock/tick_map.hpp"
#include "host-tests/support/counter_signal.hpp"
#include "host-tests/support/sync_signal.hpp"

// ns an edge of the clock, and its ratio to peers in the same run: absolute times of different machines do not compare.
namespace {

using namespace probebox;

const std::vector<Edge>& edges() {
  static const std::vector<Edge> made = [] {
    support::SyncSignal signal;
    signal.jitter = support::StampJitter::lognormal(10000, 0.5, 0.01);
    signal.missing = signal.doubled = signal.spurious = 0.005;
    support::SyncSource source{signal, 1};
    std::vector<Edge> all;
    for (int tick = 0; tick < 300'000; ++tick) {
      source.next([&](const support::StampedEdge& stamped) { all.push_back(stamped.edge); });
    }
    return all;
  }();
  return made;
}

// Five minutes of edges, learning included.
void kalman() {
  clock::ClockEstimator estimator{{}};
  for (const Edge& edge : edges()) benchmark::DoNotOptimize(estimator.push(edge));
}

const std::vector<CountedDeflection>& arrivals() {
  static const std::vector<CountedDeflection> made = [] {
    support::CounterSignal signal;
    signal.jitter = support::StampJitter::lognormal(100'000, 0.5, 0.01);
    signal.fewest_samples = signal.most_samples = 1;
    support::CounterSource source{signal, 1};
    std::vector<CountedDeflection> all;
    for (int i = 0; i < 300'000; ++i) all.push_back(source.next().front().event);
    return all;
  }();
  return made;
}

// Every sample tells the time: the dearest case.
void counter() {
  clock::CounterClock clock{{}};
  for (const auto& sample : arrivals()) benchmark::DoNotOptimize(clock.push(sample));
}

// Second-order loop: no index rules, no sigma.
void phaseLockedLoop() {
  double phase = static_cast<double>(toNs(edges().front().at));
  double period = 1e6;
  for (const Edge& edge : edges()) {
    phase += period;
    const double error = static_cast<double>(toNs(edge.at)) - phase;
    phase += 0.02 * error;
    period += 0.0002 * error;
    benchmark::DoNotOptimize(phase);
  }
}

// Median of the last 31 residuals on the nominal grid.
void slidingMedian() {
  std::array<std::int64_t, 31> window{};
  std::size_t next = 0;
  for (const Edge& edge : edges()) {
    window[next++ % window.size()] = toNs(edge.at) % 1'000'000;
    auto sorted = window;
    std::nth_element(sorted.begin(), sorted.begin() + 15, sorted.end());
    benchmark::DoNotOptimize(sorted[15]);
  }
}

template <void (*kRun)()>
void perEdge(benchmark::State& state) {
  for (auto _ : state) kRun();
  const auto done = static_cast<double>(state.iterations()) * static_cast<double>(edges().size());
  state.counters["per_edge"] = benchmark::Counter(done, benchmark::Counter::kIsRate | benchmark::Counter::kInvert);
}

void timeOfASample(benchmark::State& state) {
  const TickMap map{
      .tick = {1000}, .at = monoTime(5'000'000'000), .period_q32_ns = (std::int64_t{1'000'017} << 32) / 1 + 12345};
  SampleIndex sample{4000};
  for (auto _ : state) {
    benchmark::DoNotOptimize(clock::timeOf(map, sample, 4));
    sample = sample + 1;
  }
}

BENCHMARK(perEdge<kalman>)->Name("clock")->Unit(benchmark::kMillisecond);
BENCHMARK(perEdge<phaseLockedLoop>)->Name("peer: phase-locked loop")->Unit(benchmark::kMillisecond);
BENCHMARK(perEdge<slidingMedian>)->Name("peer: sliding median of 31")->Unit(benchmark::kMillisecond);
BENCHMARK(timeOfASample);

// Processor time: others may be using the machine.
double bestNsPerEvent(void (*run)(), std::size_t events = edges().size()) {
  double best = 1e300;
  for (int i = 0; i < 5; ++i) {
    const std::clock_t start = std::clock();
    run();
    best = std::min(best, static_cast<double>(std::clock() - start) * (1e9 / CLOCKS_PER_SEC));
  }
  return best / static_cast<double>(events);
}

}  // namespace

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  benchmark::RunSpecifiedBenchmarks();
  const double clock_ns = bestNsPerEvent(kalman);
  std::printf("clock: %.0f ns an edge = %.2f x sliding median = %.1f x phase-locked loop\n", clock_ns,
              clock_ns / bestNsPerEvent(slidingMedian), clock_ns / bestNsPerEvent(phaseLockedLoop));
  std::printf("counter clock: %.0f ns a sample that tells the time\n", bestNsPerEvent(counter, arrivals().size()));
}
