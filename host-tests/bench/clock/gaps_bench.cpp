#include <cstdio>
#include <cstdlib>

#include "gap_judge.hpp"

// Prints how far the clock is from the posterior Cramer-Rao bound, without gaps, with bursts of missing ticks, and with
// a gap of 3 s on top of these. bench_gaps [RUNS [FROM_S TO_S]]
int main(int argc, char** argv) {
  using namespace probebox;
  const int runs = argc > 1 ? std::atoi(argv[1]) : 6;
  const int from_s = argc > 3 ? std::atoi(argv[2]) : 120;
  const int to_s = argc > 3 ? std::atoi(argv[3]) : 600;
  constexpr std::array<const char*, 4> kNames{"gaussian 5 us", "lognormal 10 us", "lognormal 30 us",
                                              "lognormal 10 us, 10 x the wander"};
  struct Gaps {
    const char* name{};
    bool bursts{};
    std::int64_t silent_ticks{};
  };
  for (const Gaps& gaps : {Gaps{"without gaps"}, Gaps{"bursts", true}, Gaps{"bursts and a gap of 3 s", true, 3000}}) {
    std::printf("%s:\n  %-34s %8s %8s %7s %11s %8s %10s\n", gaps.name, "jitter", "rms ns", "bound ns", "ratio",
                "rms/sigma", "in gaps", "p99.9/rms");
    double mean = 0;
    for (std::size_t i = 0; i < kNames.size(); ++i) {
      const auto signal = clock_test::fourCases()[i];
      const auto a = clock_test::accuracyOverGaps(gaps.bursts ? clock_test::withGaps(signal) : signal, runs, from_s,
                                                  to_s, gaps.silent_ticks);
      std::printf("  %-34s %8.1f %8.1f %7.3f %11.3f %8.3f %10.2f\n", kNames[i], a.rms_ns, a.bound_ns, a.ratio(),
                  std::sqrt(a.pull), std::sqrt(a.pull_in_gaps), a.worst_to_rms);
      mean += a.ratio() / kNames.size();
    }
    std::printf("  mean ratio %.3f\n", mean);
  }
}
