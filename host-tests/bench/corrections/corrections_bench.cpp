#include <algorithm>
#include <array>
#include <benchmark/benchmark.h>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <numbers>
#include <optional>
#include <vector>

#include "firmware/metrology/live/rotary_correction.hpp"
#include "firmware/metrology/live/swivel_correction.hpp"

// ns a tick of what a swivelling head and a chain of two rotary axes add, and their ratio to a sine and a cosine in the
// same run. The program fails when a tick takes more than a microsecond.
namespace {

using namespace probebox::metrology;
using Eigen::Vector3d;

constexpr int kTicks = 200'000;
constexpr double kLimitNs = 1000.0;

CalibratedAxis axisOf(const Vector3d& direction, Between between, int count) {
  std::vector<double> angles;
  std::vector<SixErrors> errors;
  for (int k = 0; k < count; ++k) {
    angles.push_back(2.0 * std::numbers::pi * k / count);
    errors.push_back(SixErrors::Constant(0.001 * std::sin(angles.back())));
  }
  return {Vector3d{1, 2, 3}, direction, AngleTable<6>::make(angles, errors, between).value()};
}

RotaryCorrection chainOf(Between between, int count) {
  return RotaryCorrection::of(
             std::array{axisOf(Vector3d::UnitY(), between, count), axisOf(Vector3d::UnitZ(), between, count)})
      .value();
}

void rotary(const RotaryCorrection& correction) {
  for (int tick = 0; tick < kTicks; ++tick) {
    const std::array<std::optional<double>, 2> angles{1e-5 * tick, -2e-5 * tick};
    benchmark::DoNotOptimize(correction.at(angles, Vector3d{100, 50, 1e-3 * tick}));
  }
}

void linearTables() {
  static const RotaryCorrection chain = chainOf(Between::linear, 72);
  rotary(chain);
}

void fourierTables() {
  static const RotaryCorrection chain = chainOf(Between::fourier, 36);
  rotary(chain);
}

void swivel() {
  const SwivelCorrection correction{SwivelTerms{.sine = {1, 2, 3}, .sine_per_mm = {1, 2, 3}}};
  for (int tick = 0; tick < kTicks; ++tick) benchmark::DoNotOptimize(correction.at(1e-5 * tick, 150.0));
}

void sineAndCosine() {
  for (int tick = 0; tick < kTicks; ++tick) {
    benchmark::DoNotOptimize(std::sin(1e-5 * tick));
    benchmark::DoNotOptimize(std::cos(1e-5 * tick));
  }
}

// Processor time: others may be using the machine.
double bestNsPerTick(void (*run)()) {
  double best = 1e300;
  for (int i = 0; i < 7; ++i) {
    const std::clock_t start = std::clock();
    run();
    best = std::min(best, static_cast<double>(std::clock() - start) * (1e9 / CLOCKS_PER_SEC));
  }
  return best / kTicks;
}

bool shown(const char* what, void (*run)(), double unit_ns) {
  const double ns = bestNsPerTick(run);
  std::printf("%s: %.0f ns a tick = %.1f x a sine and a cosine, limit %.0f ns\n", what, ns, ns / unit_ns, kLimitNs);
  return ns <= kLimitNs;
}

}  // namespace

int main() {
  const double unit_ns = bestNsPerTick(sineAndCosine);
  bool fast = shown("swivel E(B, L)", swivel, unit_ns);
  fast = shown("two rotary axes, 72 angles each, linear", linearTables, unit_ns) && fast;
  fast = shown("two rotary axes, 36 angles each, harmonics", fourierTables, unit_ns) && fast;
  return fast ? 0 : 1;
}
