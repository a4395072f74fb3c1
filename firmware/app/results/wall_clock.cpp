#include "firmware/app/results/wall_clock.hpp"

#include <array>
#include <cstdio>
#include <fstream>
#include <mutex>
#include <optional>
#include <sys/timex.h>

#include "protocol/units/calendar.hpp"

namespace probebox::app {
namespace {

using namespace std::chrono;

// This was written then.
constexpr sys_days kWritten{year{2026} / November / 1};
// No box is in use for longer.
constexpr days kLongest{40 * 365};

struct Known {
  std::mutex mutex;
  std::optional<WallClock> clock;
  const steady_clock::time_point began{steady_clock::now()};
};

Known& known() {
  static Known one;
  return one;
}

}  // namespace

std::string dateOf(sys_seconds shown, seconds since_start, const WallClock& clock) {
  const auto day = floor<days>(shown);
  const bool is_possible = day >= kWritten && day <= kWritten + kLongest;
  if (clock.is_kept_right && is_possible) return isoUtc(shown);
  const auto which = clock.start != 0 ? "start " + std::to_string(clock.start) : "a start";
  return "unknown, " + std::to_string(since_start.count()) + " s after " + which;
}

std::string clockSource(bool synchronised, long max_error_us, bool from_hardware) {
  if (synchronised) {
    std::array<char, 96> text{};
    std::snprintf(text.data(), text.size(), "clock of the computer, synchronised within %.3g s",
                  1e-6 * static_cast<double>(max_error_us));
    return text.data();
  }
  return from_hardware ? "clock of the computer, set from its hardware clock; error unknown" : "";
}

std::string kernelClockSource() {
  timex state{};
  const bool synchronised = adjtimex(&state) >= 0 && (state.status & STA_UNSYNC) == 0;
  std::ifstream from_hardware{"/sys/class/rtc/rtc0/hctosys"};
  char is_set = '0';
  return clockSource(synchronised, state.maxerror, from_hardware >> is_set && is_set == '1');
}

void setWallClock(const WallClock& clock) {
  const std::lock_guard lock{known().mutex};
  known().clock = clock;
}

std::string utcNow() {
  const auto now = floor<seconds>(system_clock::now());
  const std::lock_guard lock{known().mutex};
  const auto& clock = known().clock;
  if (!clock) return isoUtc(now);
  auto as_now = *clock;
  // A board that has the time from a network only is synchronised some time after its start.
  as_now.is_kept_right = as_now.is_kept_right || !kernelClockSource().empty();
  return dateOf(now, floor<seconds>(steady_clock::now() - known().began), as_now);
}

std::string dateSource(std::string_view utc) {
  if (utc.starts_with("unknown")) return "unknown";
  const auto source = kernelClockSource();
  return source.empty() ? "clock of the computer; nothing is known to keep it right" : source;
}

}  // namespace probebox::app
