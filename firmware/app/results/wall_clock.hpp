#pragma once
#include <chrono>
#include <cstdint>
#include <string>

namespace probebox::app {

// What a box knows of the date: many boards have no clock that survives a power cut.
struct WallClock {
  bool is_kept_right{true};  // synchronised, set from a hardware clock, or that of an emulated box
  std::uint64_t start{};     // of the box, counted; 0: not known yet
};

// The date, ISO 8601, where the box can know it; else "unknown, 12 s after start 7". A clock that shows a day before
// the firmware was written, or decades later, was never set.
std::string dateOf(std::chrono::sys_seconds shown, std::chrono::seconds since_start, const WallClock& clock);

// What keeps the kernel's clock right, and how well as far as it is known; empty where nothing does.
std::string kernelClockSource();
// The same from the kernel's state: status and maximum error (us) of adjtimex, and whether a hardware clock set it.
std::string clockSource(bool synchronised, long max_error_us, bool from_hardware);

// Tells utcNow() what the box knows. Before the first call every date is believed.
void setWallClock(const WallClock& clock);
// Now, as dateOf().
std::string utcNow();
// Where that date comes from, for the record: "unknown" where there is none.
std::string dateSource(std::string_view utc);

}  // namespace probebox::app
