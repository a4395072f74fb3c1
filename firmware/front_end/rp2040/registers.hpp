#pragma once
#include <cstddef>
#include <cstdint>

// Registers of the RP2040 that the front end uses, by the names and chapters of its data sheet.
namespace probebox::front_end {

using Register = volatile std::uint32_t;

inline Register& at(std::uint32_t address) {
  return *reinterpret_cast<Register*>(address);
}

// 2.1.2: writes to these aliases of a register set or clear bits.
inline void setBits(std::uint32_t address, std::uint32_t bits) {
  at(address + 0x2000) = bits;
}
inline void clearBits(std::uint32_t address, std::uint32_t bits) {
  at(address + 0x3000) = bits;
}

namespace sio {  // 2.3.1
inline constexpr std::uint32_t kIn = 0xd000'0004, kOutSet = 0xd000'0014, kOutClear = 0xd000'0018,
                               kOutEnableSet = 0xd000'0024;
}
namespace dma {  // 2.5.7
inline constexpr std::uint32_t kBase = 0x5000'0000, kAbort = kBase + 0x444, kTrigger = kBase + 0x430;
constexpr std::uint32_t readAddress(unsigned channel) {
  return kBase + 0x40 * channel;
}
constexpr std::uint32_t writeAddress(unsigned channel) {
  return kBase + 0x40 * channel + 0x04;
}
constexpr std::uint32_t count(unsigned channel) {
  return kBase + 0x40 * channel + 0x08;
}
constexpr std::uint32_t control(unsigned channel) {
  return kBase + 0x40 * channel + 0x10;
}  // AL1: does not trigger
constexpr std::uint32_t readAddressTrigger(unsigned channel) {
  return kBase + 0x40 * channel + 0x3c;
}
inline constexpr std::uint32_t kEnable = 1U << 0U, kWord = 2U << 2U, kIncrementRead = 1U << 4U,
                               kIncrementWrite = 1U << 5U, kRingOnWrite = 1U << 10U, kQuiet = 1U << 21U,
                               kBusy = 1U << 24U;
constexpr std::uint32_t ringBits(unsigned bits) {
  return bits << 6U;
}
constexpr std::uint32_t chainTo(unsigned channel) {
  return channel << 11U;
}
constexpr std::uint32_t pacedBy(unsigned request) {
  return request << 15U;
}
inline constexpr unsigned kUnpaced = 0x3f, kPio0Rx0 = 4, kPio1Rx0 = 12;
}  // namespace dma
namespace resets {  // 2.14.3
inline constexpr std::uint32_t kReset = 0x4000'c000, kDone = kReset + 0x8;
inline constexpr std::uint32_t kDma = 1U << 2U, kIoBank0 = 1U << 5U, kPadsBank0 = 1U << 8U, kPio0 = 1U << 10U,
                               kPio1 = 1U << 11U, kPllSys = 1U << 12U, kPllUsb = 1U << 13U, kSpi0 = 1U << 16U,
                               kTimer = 1U << 21U, kUsb = 1U << 24U;
}  // namespace resets
namespace clocks {  // 2.15.7
inline constexpr std::uint32_t kBase = 0x4000'8000, kRefControl = kBase + 0x30, kRefSelected = kBase + 0x38,
                               kSysControl = kBase + 0x3c, kSysSelected = kBase + 0x44, kPeriControl = kBase + 0x48,
                               kUsbControl = kBase + 0x54;
}
namespace xosc {  // 2.16.7
inline constexpr std::uint32_t kControl = 0x4002'4000, kStatus = kControl + 0x4, kStartup = kControl + 0xc;
}
namespace pll {  // 2.18.4
inline constexpr std::uint32_t kSys = 0x4002'8000, kUsb = 0x4002'c000;
}
namespace psm {  // 2.13.5
inline constexpr std::uint32_t kWatchdogSelect = 0x4001'0008;
}
namespace io {  // 2.19.6
constexpr std::uint32_t control(unsigned gpio) {
  return 0x4001'4004 + 8 * gpio;
}
constexpr std::uint32_t pad(unsigned gpio) {
  return 0x4001'c004 + 4 * gpio;
}
constexpr std::uint32_t rawInterrupt(unsigned gpio) {
  return 0x4001'40f0 + 4 * (gpio / 8);
}
constexpr std::uint32_t edgeHigh(unsigned gpio) {
  return 1U << (4 * (gpio % 8) + 3);
}
inline constexpr std::uint32_t kSpi = 1, kSio = 5, kPio1 = 7;
inline constexpr std::uint32_t kInputPad = 0x46;   // input enabled, pulled down, Schmitt trigger
inline constexpr std::uint32_t kOutputPad = 0x12;  // 4 mA, Schmitt trigger, not pulled
inline constexpr std::uint32_t kQspiSelectControl = 0x4001'800c;
}  // namespace io
namespace pio {  // 3.7
inline constexpr std::uint32_t k0 = 0x5020'0000, k1 = 0x5030'0000;
inline constexpr std::uint32_t kControl = 0x00, kFifoStatus = 0x04, kFifoDebug = 0x08, kTx = 0x10, kRx = 0x20,
                               kIrq = 0x30, kMemory = 0x48;
constexpr std::uint32_t machine(unsigned number) {
  return 0xc8 + 0x18 * number;
}
inline constexpr std::uint32_t kDivider = 0x0, kExecControl = 0x4, kShiftControl = 0x8, kExecute = 0x10, kPins = 0x14;
}  // namespace pio
namespace usb_device {  // 4.1.4
inline constexpr std::uint32_t kMemory = 0x5010'0000, kBase = 0x5011'0000;
inline constexpr std::uint32_t kAddress = kBase, kMainControl = kBase + 0x40, kSieControl = kBase + 0x4c,
                               kSieStatus = kBase + 0x50, kBufferStatus = kBase + 0x58, kAbort = kBase + 0x60,
                               kAbortDone = kBase + 0x64, kStallArm = kBase + 0x68, kMuxing = kBase + 0x74,
                               kPower = kBase + 0x78;
}  // namespace usb_device
namespace spi {  // 4.4.4, SPI0
inline constexpr std::uint32_t kControl0 = 0x4003'c000, kControl1 = kControl0 + 0x4, kData = kControl0 + 0x8,
                               kStatus = kControl0 + 0xc, kPrescale = kControl0 + 0x10;
inline constexpr std::uint32_t kNotEmpty = 1U << 2U;
}  // namespace spi
namespace timer {                                   // 4.6.5
inline constexpr std::uint32_t kLow = 0x4005'4028;  // us
}
namespace watchdog {  // 4.7.6
inline constexpr std::uint32_t kControl = 0x4005'8000, kLoad = kControl + 0x4, kReason = kControl + 0x8,
                               kTick = kControl + 0x2c;
}
namespace power {  // 2.12.8
inline constexpr std::uint32_t kChipReset = 0x4006'4008;
}
namespace ssi {  // 4.10.13
inline constexpr std::uint32_t kBase = 0x1800'0000, kControl0 = kBase, kControl1 = kBase + 0x4, kEnable = kBase + 0x8,
                               kSelect = kBase + 0x10, kBaud = kBase + 0x14, kStatus = kBase + 0x28,
                               kData = kBase + 0x60;
}
inline constexpr std::uint32_t kVectorTable = 0xe000'ed08;

}  // namespace probebox::front_end
