#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <string_view>

#include "protocol/units/outcome.hpp"

namespace probebox::serial {

// Supported speeds, baud.
inline constexpr std::array<unsigned, 21> kRates{1200,    2400,    4800,    9600,    19200,   38400,   57600,
                                                 115200,  230400,  460800,  500000,  576000,  921600,  1000000,
                                                 1152000, 1500000, 2000000, 2500000, 3000000, 3500000, 4000000};

enum class Parity : std::uint8_t { none, even, odd };

struct Settings {
  unsigned baud{115200};
  Parity parity{Parity::none};
  unsigned data_bits{8};  // 7 or 8
  unsigned stop_bits{1};  // 1 or 2
  // The line's driver switches an RS-485 transceiver to sending and back (TIOCSRS485: RTS, or the line that its device
  // tree names). Adapters that turn by themselves need no setting.
  bool rs485{};
};

// With the start bit.
constexpr unsigned bitsPerCharacter(const Settings& settings) {
  return 1 + settings.data_bits + (settings.parity != Parity::none ? 1 : 0) + settings.stop_bits;
}

// Default settings of a link to a host.
inline constexpr Settings kHostLink{.baud = 921600};

struct Address {
  std::string path;
  Settings settings;
};

// Parses "DEVICE[,baud=19200][,parity=even][,data=8][,stop=1][,rs485=kernel]"; defaults come from `usual`. An unknown
// setting or a speed outside kRates is an error with its remedy.
Outcome<Address> parseAddress(std::string_view text, const Settings& usual = {});

// "19200 8E1"
std::string describe(const Settings& settings);

}  // namespace probebox::serial
