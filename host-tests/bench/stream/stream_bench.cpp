// 100 kS/s of the reference record from events to a host's decoded samples, on one core: clock, latch, codec, session,
// a connection over the loopback, reader. CPU time of everything, kernel included, beside the time that the samples
// took. `bench_stream [seconds]`; status 1 when the limit or a counter is missed.
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "chain.hpp"

namespace {

using namespace probebox;

constexpr double kLimit = 1.0;  // times real time

double cpuSeconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

bool measure(messages::Profile profile, const std::vector<Event>& events) {
  chain::Chain chain{profile};
  const double before = cpuSeconds();
  chain.run(events);
  chain.finish();
  const double took = cpuSeconds() - before;
  const auto& account = chain.account();
  const auto produced = chain.sent().produced();
  const double per_second = static_cast<double>(produced) / took;
  const double times = per_second / chain::kSamplesPerSecond;
  const bool good = chain.exact() && times >= kLimit;
  std::printf(
      "%-5s %5.2f M samples/s of CPU: %5.1f x real time at 100 kS/s (limit %.0f x, headroom %.0f %%)   "
      "%llu produced = %llu received + %llu declared lost   %.2f B/sample   %s\n",
      std::string{messages::nameOf(profile)}.c_str(), per_second * 1e-6, times, kLimit, 100 * (1 - kLimit / times),
      static_cast<unsigned long long>(produced), static_cast<unsigned long long>(account.received),
      static_cast<unsigned long long>(account.declared_lost),
      static_cast<double>(chain.wireBytes()) / static_cast<double>(account.received), good ? "ok" : "MISSED");
  return good;
}

}  // namespace

int main(int count, char** words) {
  const std::chrono::seconds lasts{count > 1 ? std::atoi(words[1]) : 20};
  const auto events = chain::scanEvents(lasts, std::chrono::milliseconds{5});
  const bool raw = measure(messages::Profile::raw, events);
  const bool fast = measure(messages::Profile::fast, events);
  return raw && fast ? 0 : 1;
}
