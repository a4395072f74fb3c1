#include <cstdio>

#include "tools/tour/tour.hpp"

namespace probebox::tour {

using namespace std::chrono_literals;

Stopped showClock(Stage& stage) {
  constexpr int kLooks = 12;
  constexpr double kPpbPerPpm = 1e3;
  std::puts("\n1. The master clock: 1000 edges a second, stamped late and unevenly, become ticks.");
  TRY(auto client, meet(stage.box, nullptr));
  messages::ClockStatus clock;
  for (int look = 0; look < kLooks; ++look) {
    const auto status = client->request<messages::Status>({}, link::patience(5s));
    if (!status) return Error{status.error().what};
    clock = status->clock;
    const auto& edges = clock.edges;
    std::printf(
        "   %4.1f s  %-9s sigma %7u ns   frequency %+8.3f ppm   edges %llu, missing %llu, doubled %llu, spurious "
        "%llu, before the lock %llu\n",
        0.5 * look, std::string{messages::nameOf(clock.state)}.c_str(), clock.sigma_ns,
        clock.frequency_ppb / kPpbPerPpm, static_cast<unsigned long long>(edges.accepted),
        static_cast<unsigned long long>(edges.missing), static_cast<unsigned long long>(edges.doubled),
        static_cast<unsigned long long>(edges.spurious), static_cast<unsigned long long>(edges.unlocked));
    std::fflush(stdout);
    linger(*client, 500ms);
  }
  std::printf("   (the emulated clock really runs %+.3f ppm off)\n", -stage.truth.drift_ppm);
  stage.table.exact("master clock", "locked, sigma " + std::to_string(clock.sigma_ns) + " ns",
                    clock.state == ClockState::locked);
  return {};
}

}  // namespace probebox::tour
