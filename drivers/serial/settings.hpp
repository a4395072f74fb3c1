#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include "protocol/units/outcome.hpp"

namespace probebox::serial {

// Supported speeds, baud.
inline constexpr std::array<unsigned, 21> kRates{1200,    2400,    4800,    9600,    19200,   38400,   57600,
                                                 115200,  230400,  460800,  500000,  576000,  921600,  1000000,
                                                 1152000, 1500000, 2000000, 2500000, 3000000, 3500000, 4000000};

enum class Parity : std::uint8_t { none, even, odd };

// Who turns an RS-485 transceiver from listening to sending and back.
enum class Turning : std::uint8_t {
  none,    // nobody, or the adapter itself
  kernel,  // the line's driver (TIOCSRS485), by RTS or by the line that its device tree names
  rts,     // this program, by RTS
  gpio     // this program, by a line of a gpio chip
};

// Longest delay that the kernel takes.
inline constexpr unsigned kMostTurning_ms = 100;

struct Rs485 {
  Turning by{};
  std::string gpio{};      // the line's name, or "CHIP/OFFSET"
  bool active_high{true};  // level of RTS or of the line while this end sends
  unsigned before_ms{};    // from turning to the first bit
  unsigned after_ms{};     // from the last bit to turning back
  friend bool operator==(const Rs485&, const Rs485&) = default;
};

struct Settings {
  unsigned baud{115200};
  Parity parity{Parity::none};
  unsigned data_bits{8};  // 7 or 8
  unsigned stop_bits{1};  // 1 or 2
  Rs485 rs485{};
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

// Parses "DEVICE[,baud=19200][,parity=even][,data=8][,stop=1][,rs485=kernel|rts|gpio:LINE][,rs485_active=high|low]
// [,rs485_before_ms=0][,rs485_after_ms=0]"; defaults come from `usual`. An unknown setting, a speed outside kRates and
// a setting of a transceiver that nobody turns are errors with their remedies.
Outcome<Address> parseAddress(std::string_view text, const Settings& usual = {});

// Refuses a transceiver that this program turns: a link to a host sends and receives at the same time.
std::optional<Error> whyNoHostLink(const Address& address);

// "19200 8E1"
std::string describe(const Settings& settings);

}  // namespace probebox::serial
