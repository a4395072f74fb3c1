#pragma once
#include <array>
#include <cstdint>

namespace probebox::front_end {

// 125 MHz from the crystal of 12 MHz, 48 MHz for USB, pins, a timer of 1 us.
void startChip();
inline constexpr std::uint32_t kWatchdogUs = 100'000;
void startWatchdog();
void feedWatchdog();
std::uint32_t nowUs();
void setLed(bool on);

// Why the program started.
struct StartCause {
  bool watchdog{}, brown_out{};
  std::uint8_t run{};  // +1 at each start
};
StartCause startCause();

// The unique number of the flash, in hexadecimal digits; zeros where it does not answer.
std::array<char, 16> flashIdentity();

// Ends the program: the chip waits for another one on USB.
[[noreturn]] void restartIntoBootLoader();

}  // namespace probebox::front_end
