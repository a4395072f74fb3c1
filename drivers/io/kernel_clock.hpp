#pragma once
#include <chrono>

namespace probebox::io {

// The time of day as this computer's kernel has it, and what keeps it right.
struct KernelClock {
  std::chrono::sys_time<std::chrono::microseconds> utc{};
  bool synchronised{};                        // by a time server or a hardware reference (adjtimex(2))
  std::chrono::microseconds largest_error{};  // while it is synchronised
  bool from_hardware{};                       // set at the start from a clock that survives a power cut

  bool isKept() const { return synchronised || from_hardware; }
};

KernelClock kernelClock();

}  // namespace probebox::io
