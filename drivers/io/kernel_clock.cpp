#include "drivers/io/kernel_clock.hpp"

#include <cstdint>
#include <fstream>
#include <sys/timex.h>

namespace probebox::io {
namespace {

// Once, as this program starts.
bool wasSetFromHardware() {
  using namespace std::chrono;
  std::ifstream from_hardware{"/sys/class/rtc/rtc0/hctosys"}, hardware{"/sys/class/rtc/rtc0/since_epoch"};
  char is_set = '0';
  std::int64_t since_epoch_s = 0;
  return from_hardware >> is_set && is_set == '1' && hardware >> since_epoch_s &&
         isSetFrom(sys_seconds{seconds{since_epoch_s}}, floor<seconds>(system_clock::now()));
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
