#include "drivers/io/kernel_clock.hpp"

#include <fstream>
#include <sys/timex.h>

namespace probebox::io {
namespace {

// Once, as the system starts.
bool wasSetFromHardware() {
  std::ifstream from_hardware{"/sys/class/rtc/rtc0/hctosys"};
  char is_set = '0';
  return from_hardware >> is_set && is_set == '1';
}

}  // namespace

KernelClock kernelClock() {
  using namespace std::chrono;
  timex state{};
  const bool synchronised = adjtimex(&state) >= 0 && (state.status & STA_UNSYNC) == 0;
  static const bool from_hardware = wasSetFromHardware();
  return {.utc = floor<microseconds>(system_clock::now()),
          .synchronised = synchronised,
          .largest_error = microseconds{state.maxerror},
          .from_hardware = from_hardware};
}

}  // namespace probebox::io
