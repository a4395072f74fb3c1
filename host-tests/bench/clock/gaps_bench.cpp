#include <cstdio>
#include <cstdlib>

#include "gap_judge.hpp"

// Prints how far the clock is from the posterior Cramer-Rao bound, with and without gaps.
// bench_gaps [RUNS [FROM_S TO_S]]
int main(int argc, char** argv) {
  using namespace probebox;
  const int runs = argc > 1 ? std::atoi(argv[1]) : 6;
  const int from_s = argc > 3 ? std::atoi(argv[2]) : 120;
  const int to_s = argc > 3 ? std::atoi(argv[3]) : 600;
  constexpr std::array<const char*, 4> kNames{"gaussian 5 us", "lognormal 10 us", "lognormal 30 us",
                                              "lognormal 10 us, 10 x the wander"};
  for (const bool gaps : {false, true}) {
    std::printf("%s gaps:\n  %-34s %8s %8s %7s %11s %8s\n", gaps ? "with" : "without", "jitter", "rms ns", "bound ns",
                "ratio", "rms/sigma", "in gaps");
    double mean = 0;
    for (std::size_t i = 0; i < kNames.size(); ++i) {
      const auto signal = clock_test::fourCases()[i];
      const auto a = clock_test::accuracyOverGaps(gaps ? clock_test::withGaps(signal) : signal, runs, from_s, to_s);
      std::printf("  %-34s %8.1f %8.1f %7.3f %11.3f %8.3f\n", kNames[i], a.rms_ns, a.bound_ns, a.ratio(),
                  std::sqrt(a.pull), std::sqrt(a.pull_in_gaps));
      mean += a.ratio() / kNames.size();
    }
    std::printf("  mean ratio %.3f\n", mean);
  }
}
