#include "firmware/front_end/rp2040/converter.hpp"

#include "firmware/front_end/rp2040/registers.hpp"
#include "protocol/receiver/front_end.hpp"

namespace probebox::front_end {
namespace {

// A conversion takes 4.15 us without oversampling, and three words 4 us.
constexpr std::uint32_t kLongestUs = 40;

void select(bool on) {
  at(on ? sio::kOutClear : sio::kOutSet) = 1U << kSelectPin;
}
// Returns whether BUSY has risen since the last call.
bool takeBusyRise() {
  const auto bit = io::edgeHigh(kBusyPin);
  const bool risen = (at(io::rawInterrupt(kBusyPin)) & bit) != 0;
  if (risen) at(io::rawInterrupt(kBusyPin)) = bit;
  return risen;
}

}  // namespace

void Ad7606::prepare() {
  // The clock rests high; data are taken at its falling edge. 125 MHz / (2 * 5) = 12.5 MHz.
  constexpr std::uint32_t kBits16 = 15, kRestsHigh = 1U << 6U, kDivider = 4U << 8U;
  at(spi::kPrescale) = 2;
  at(spi::kControl0) = kBits16 | kRestsHigh | kDivider;
  at(spi::kControl1) = 1U << 1U;
  select(false);
}

void Ad7606::begin(std::uint32_t now_us) {
  if (state_ == State::reading) select(false);
  for (int tries = 8; tries > 0 && (at(spi::kStatus) & spi::kNotEmpty) != 0; --tries)
    values_[0] = static_cast<std::int16_t>(at(spi::kData));
  state_ = State::converting;
  begun_us_ = now_us;
}

Ad7606::State Ad7606::poll(std::uint32_t now_us) {
  if (state_ == State::converting && (at(sio::kIn) >> kBusyPin & 1U) == 0 && takeBusyRise()) {
    select(true);
    for (std::size_t i = 0; i < values_.size(); ++i) at(spi::kData) = 0;
    read_ = 0;
    state_ = State::reading;
  }
  while (state_ == State::reading && (at(spi::kStatus) & spi::kNotEmpty) != 0) {
    values_[read_++] = static_cast<std::int16_t>(at(spi::kData));
    if (read_ < values_.size()) continue;
    select(false);
    state_ = State::done;
  }
  const bool waits = state_ == State::converting || state_ == State::reading;
  if (waits && now_us - begun_us_ > kLongestUs) {
    select(false);
    state_ = State::silent;
  }
  return state_;
}

}  // namespace probebox::front_end
