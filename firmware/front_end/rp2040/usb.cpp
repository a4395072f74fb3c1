#include "firmware/front_end/rp2040/usb.hpp"

#include <algorithm>
#include <array>
#include <span>

#include "firmware/front_end/rp2040/registers.hpp"

namespace probebox::front_end {
namespace {

using namespace usb_device;

// The controller's memory, 4.1.2.5.
constexpr std::uint32_t kBulkControl = kMemory + 0x08, kControlIn = kMemory + 0x80, kControlOut = kMemory + 0x84,
                        kBulkIn = kMemory + 0x88, kControlData = kMemory + 0x100, kBulkData = kMemory + 0x180;
// Buffer control.
constexpr std::uint32_t kFull = 1U << 15U, kData1 = 1U << 13U, kStall = 1U << 11U, kAvailable = 1U << 10U,
                        kLengthMask = 0x3ff;
// Bits of the buffer status, of aborted buffers and of armed stalls.
constexpr std::uint32_t kOfControlIn = 1U << 0U, kOfControlOut = 1U << 1U, kOfBulkIn = 1U << 2U;
// SIE_STATUS
constexpr std::uint32_t kBusReset = 1U << 19U, kSetupReceived = 1U << 17U;

void copyIn(std::uint32_t to, std::span<const std::byte> bytes) {
  for (std::size_t i = 0; i < bytes.size(); i += 4) {
    std::uint32_t word = 0;
    for (std::size_t k = 0; k < std::min<std::size_t>(4, bytes.size() - i); ++k)
      word |= std::to_integer<std::uint32_t>(bytes[i + k]) << (8 * k);
    at(to + static_cast<std::uint32_t>(i)) = word;
  }
}

void copyOut(std::uint32_t from, std::span<std::byte> bytes) {
  for (std::size_t i = 0; i < bytes.size(); ++i)
    bytes[i] = static_cast<std::byte>(at(from + static_cast<std::uint32_t>(i & ~std::size_t{3})) >> (8 * (i % 4)));
}

// 4.1.2.5.1: the controller, on a slower clock, must see the rest before the buffer is available.
void hand(std::uint32_t buffer_control, std::uint32_t value) {
  at(buffer_control) = value;
  for (int i = 0; i < 12; ++i) asm volatile("nop");
  at(buffer_control) = value | kAvailable;
}

}  // namespace

void Usb::start() {
  for (std::uint32_t i = 0; i < 0x180; i += 4) at(kMemory + i) = 0;
  at(kMuxing) = 1U << 0U | 1U << 3U;  // to the transceiver; connected by software
  at(kPower) = 1U << 2U | 1U << 3U;   // there is no pin for VBUS
  at(kSieControl) = 1U << 29U;        // an interrupt flag for each buffer of endpoint 0
  constexpr std::uint32_t kEnable = 1U << 31U, kEachBuffer = 1U << 29U, kBulk = 2U << 26U;
  at(kBulkControl) = kEnable | kEachBuffer | kBulk | (kBulkData - kMemory);
  at(kMainControl) = 1;
  setBits(kSieControl, 1U << 16U);  // pull-up
}

void Usb::disconnect() {
  clearBits(kSieControl, 1U << 16U);
}

void Usb::poll() {
  const std::uint32_t status = at(kSieStatus);
  if ((status & kBusReset) != 0) {
    at(kSieStatus) = kBusReset;
    at(kAddress) = 0;
    stage_ = Stage::idle;
    control_.reset();
  }
  const std::uint32_t buffers = at(kBufferStatus);
  if (buffers != 0) at(kBufferStatus) = buffers;
  if ((buffers & kOfControlIn) != 0) controlSent();
  if ((buffers & kOfControlOut) != 0) controlReceived(at(kControlOut) & kLengthMask);
  if ((buffers & kOfBulkIn) != 0 && is_in_flight_) {
    is_in_flight_ = false;
    sent_ += in_flight_;
    if (is_last_) {
      sent_ = 0;
      assembly_.taken();
    }
  }
  if ((status & kSetupReceived) != 0) {
    at(kSieStatus) = kSetupReceived;
    takeSetup();
  }
  if (control_.takeNewHost()) beginAnew();
  if (!is_in_flight_ && control_.configured() && !control_.halted()) sendBulk();
}

void Usb::takeSetup() {
  std::array<std::byte, 8> bytes{};
  copyOut(kMemory, bytes);
  stage_ = Stage::idle;
  answer(control_.setup(bytes));
}

void Usb::answer(const Answer& answer) {
  switch (answer.kind) {
    case Answer::Kind::stall:
      return stall();
    case Answer::Kind::in:
      stage_ = Stage::data_in;
      copyIn(kControlData, answer.bytes);
      return hand(kControlIn, kFull | kData1 | static_cast<std::uint32_t>(answer.bytes.size()));
    case Answer::Kind::out:
      stage_ = Stage::data_out;
      return hand(kControlOut, kData1 | kControlBytes);
    case Answer::Kind::acknowledge:
      stage_ = Stage::status_in;
      return hand(kControlIn, kFull | kData1);
  }
}

void Usb::stall() {
  stage_ = Stage::idle;
  at(kStallArm) = kOfControlIn | kOfControlOut;
  at(kControlOut) = kStall;
  at(kControlIn) = kStall;
}

void Usb::controlSent() {
  if (stage_ == Stage::data_in) {
    stage_ = Stage::status_out;
    hand(kControlOut, kData1 | kControlBytes);
  } else if (stage_ == Stage::status_in) {
    stage_ = Stage::idle;
    at(kAddress) = control_.address();
  }
}

void Usb::controlReceived(std::size_t size) {
  if (stage_ == Stage::data_out) {
    std::array<std::byte, kControlBytes> bytes{};
    const auto data = std::span{bytes}.first(std::min(size, bytes.size()));
    copyOut(kControlData, data);
    answer(control_.data(data));
  } else {
    stage_ = Stage::idle;
  }
}

// A buffer that the controller has is taken back first (4.1.2.5.3).
void Usb::beginAnew() {
  if (is_in_flight_) {
    at(kAbort) = kOfBulkIn;
    for (int tries = 1000; tries > 0 && (at(kAbortDone) & kOfBulkIn) == 0; --tries) {
    }
    at(kBulkIn) = 0;
    at(kAbortDone) = kOfBulkIn;
    at(kAbort) = 0;
  }
  at(kBulkIn) = control_.halted() ? kStall : 0;
  is_in_flight_ = data1_ = false;
  sent_ = 0;
  assembly_.discard();
}

// A packet ends its transfer with a short part, which may be empty.
void Usb::sendBulk() {
  const auto* const held = assembly_.packets().front();
  if (held == nullptr) return;
  in_flight_ = std::min(held->size - sent_, kBulkBytes);
  is_last_ = in_flight_ < kBulkBytes;
  copyIn(kBulkData, std::span{held->bytes}.subspan(sent_, in_flight_));
  is_in_flight_ = true;
  hand(kBulkIn, kFull | (data1_ ? kData1 : 0) | static_cast<std::uint32_t>(in_flight_));
  data1_ = !data1_;
}

}  // namespace probebox::front_end
