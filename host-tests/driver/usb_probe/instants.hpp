#pragma once
#include "protocol/units/time.hpp"

namespace probebox::usb_probe {

inline constexpr MonoTime kStart = monoTime(1'000'000'000);    // of the emulated receiver
inline constexpr MonoTime kArrived = monoTime(5'000'000'000);  // of a transfer

}  // namespace probebox::usb_probe
