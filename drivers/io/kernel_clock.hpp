#pragma once
#include <chrono>

namespace probebox::io {

// The time of day as this computer's kernel has it, and what keeps it right.
struct KernelClock {
  std::chrono::sys_time<std::chrono::microseconds> utc{};
  bool synchronised{};                        // by a time server or a hardware reference (adjtimex(2))
  std::chrono::microseconds largest_error{};  // while it is synchronised
  bool from_hardware{};                       // set at the start from a clock that survives a power cut, isSetFrom()

  bool isKept() const { return synchronised || from_hardware; }
};

// Whether a clock shows what a hardware clock does. Behind a dead battery that one begins years ago, and systemd puts
// the kernel's clock forward to the day of the image. Less than a day apart: a hardware clock may be in local time.
constexpr bool isSetFrom(std::chrono::sys_seconds hardware, std::chrono::sys_seconds shown) {
  return std::chrono::abs(hardware - shown) < std::chrono::days{1};
}

KernelClock kernelClock();

}  // namespace probebox::io
