#include "firmware/front_end/rp2040/chip.hpp"

#include <utility>

#include "firmware/front_end/rp2040/registers.hpp"
#include "protocol/receiver/front_end.hpp"

namespace probebox::front_end {
namespace {

// Waits at start only; a clock that never comes is left to the watchdog, or to the person who finds no device.
void await(std::uint32_t address, std::uint32_t bits) {
  for (int tries = 1'000'000; tries > 0 && (at(address) & bits) != bits; --tries) {
  }
}

// f = 12 MHz * multiple / (first * second)
void startPll(std::uint32_t base, std::uint32_t multiple, std::uint32_t first, std::uint32_t second) {
  constexpr std::uint32_t kControl = 0x0, kPowerDown = 0x4, kMultiple = 0x8, kDividers = 0xc;
  constexpr std::uint32_t kNoDither = 1U << 2U, kDividersOff = 1U << 3U, kLocked = 1U << 31U;
  at(base + kControl) = 1;
  at(base + kMultiple) = multiple;
  at(base + kPowerDown) = kNoDither | kDividersOff;
  await(base + kControl, kLocked);
  at(base + kDividers) = first << 16U | second << 12U;
  at(base + kPowerDown) = kNoDither;
}

// Resets peripherals and waits until they are there.
void renew(std::uint32_t peripherals) {
  setBits(resets::kReset, peripherals);
  clearBits(resets::kReset, peripherals);
  await(resets::kDone, peripherals);
}

void startClocks() {
  constexpr std::uint32_t kFrom1To15MHz = 0xaa0, kEnable = 0xfabU << 12U, kStable = 1U << 31U;
  at(xosc::kStartup) = 47;  // 1 ms in units of 256 periods
  at(xosc::kControl) = kFrom1To15MHz | kEnable;
  await(xosc::kStatus, kStable);
  at(clocks::kRefControl) = 2;  // the crystal
  await(clocks::kRefSelected, 1U << 2U);
  at(clocks::kSysControl) = 0;  // the reference, while the PLL starts
  await(clocks::kSysSelected, 1U << 0U);
  renew(resets::kPllSys | resets::kPllUsb);
  startPll(pll::kSys, 125, 6, 2);
  startPll(pll::kUsb, 100, 5, 5);
  at(clocks::kSysControl) = 1;  // from its second multiplexer, which is at the PLL
  await(clocks::kSysSelected, 1U << 1U);
  constexpr std::uint32_t kOn = 1U << 11U;
  at(clocks::kPeriControl) = kOn;  // the system's
  at(clocks::kUsbControl) = kOn;   // the PLL for USB
  at(watchdog::kTick) = 12 | 1U << 9U;
}

std::uint32_t functionOf(const Pin& pin) {
  if (pin.gpio == kConvertPin || pin.gpio == kSyncOutPin) return io::kPio1;
  if (pin.gpio == kClockPin || pin.gpio == kDataPin) return io::kSpi;
  return io::kSio;
}

void startPins() {
  at(sio::kOutSet) = 1U << kSelectPin;
  at(sio::kOutEnableSet) = 1U << kSelectPin | 1U << kLedPin;
  for (const auto& pin : kPins) {
    at(io::pad(pin.gpio)) = pin.use == PinUse::input ? io::kInputPad : io::kOutputPad;
    at(io::control(pin.gpio)) = functionOf(pin);
  }
}

// Kept over a start of the program without loss of supply.
struct Remembered {
  static constexpr std::uint32_t kMagic = 0x50524F42;
  std::uint32_t magic, run;
};
[[gnu::section(".remembered")]] volatile Remembered remembered;

}  // namespace

void startChip() {
  startClocks();
  constexpr std::uint32_t kUsed = resets::kDma | resets::kIoBank0 | resets::kPadsBank0 | resets::kPio0 | resets::kPio1 |
                                  resets::kSpi0 | resets::kTimer | resets::kUsb;
  renew(kUsed);
  startPins();
}

void startWatchdog() {
  at(psm::kWatchdogSelect) = 0x1'fffc;  // all but the oscillators
  feedWatchdog();
  at(watchdog::kControl) = 1U << 30U;
}

// 4.7.6: it counts by two each microsecond.
void feedWatchdog() {
  at(watchdog::kLoad) = 2 * kWatchdogUs;
}

std::uint32_t nowUs() {
  return at(timer::kLow);
}

void setLed(bool on) {
  at(on ? sio::kOutSet : sio::kOutClear) = 1U << kLedPin;
}

// What was remembered goes on where the supply failed too briefly for the memory to fade: a brown-out. After a longer
// failure the memory is random, and the start is a cold one.
StartCause startCause() {
  const bool is_known = remembered.magic == Remembered::kMagic;
  const bool by_watchdog = is_known && (at(watchdog::kReason) & 1U) != 0;
  constexpr std::uint32_t kSupply = 1U << 8U;
  const bool supply_failed = (at(power::kChipReset) & kSupply) != 0;
  remembered.run = remembered.run + 1;
  remembered.magic = Remembered::kMagic;
  return {by_watchdog, is_known && !by_watchdog && supply_failed, static_cast<std::uint8_t>(remembered.run)};
}

std::array<char, 16> flashIdentity() {
  constexpr std::uint32_t kReadIdentity = 0x4b, kBits8 = 7U << 16U, kReceives = 1U << 3U, kTransmits = 1U << 1U,
                          kForcedLow = 2U << 8U, kForcedHigh = 3U << 8U;
  constexpr std::size_t kBefore = 5;  // the command and four bytes that do not matter
  std::array<char, 16> digits;
  digits.fill('0');
  at(ssi::kEnable) = 0;
  at(ssi::kControl0) = kBits8;
  at(ssi::kControl1) = 0;
  at(ssi::kBaud) = 8;
  at(ssi::kSelect) = 1;
  at(ssi::kEnable) = 1;
  at(io::kQspiSelectControl) = kForcedLow;
  for (std::size_t i = 0; i < kBefore + digits.size() / 2; ++i) {
    await(ssi::kStatus, kTransmits);
    at(ssi::kData) = i == 0 ? kReadIdentity : 0;
    await(ssi::kStatus, kReceives);
    const auto byte = at(ssi::kData) & 0xFFU;
    if (i < kBefore) continue;
    constexpr const char* kDigits = "0123456789ABCDEF";
    digits[2 * (i - kBefore)] = kDigits[byte >> 4U];
    digits[2 * (i - kBefore) + 1] = kDigits[byte & 0xFU];
  }
  at(io::kQspiSelectControl) = kForcedHigh;
  return digits;
}

// 2.8.3: the table of the boot ROM is searched by a function of the ROM.
void restartIntoBootLoader() {
  constexpr std::uint32_t kTablePointer = 0x14, kLookupPointer = 0x18, kToUsbBoot = 'U' | 'B' << 8U;
  const auto pointerAt = [](std::uint32_t address) {
    asm("" : "+r"(address));  // or the compiler takes an address below 4096 for a mistake
    return at(address) & 0xFFFFU;
  };
  if (const auto lookup = pointerAt(kLookupPointer); lookup != 0) {
    const auto find = reinterpret_cast<std::uint32_t (*)(std::uint32_t, std::uint32_t)>(lookup);
    const auto boot =
        reinterpret_cast<void (*)(std::uint32_t, std::uint32_t)>(find(pointerAt(kTablePointer), kToUsbBoot));
    if (boot != nullptr) boot(0, 0);
  }
  at(watchdog::kControl) = 1U << 31U;
  while (true) {
  }
}

}  // namespace probebox::front_end
