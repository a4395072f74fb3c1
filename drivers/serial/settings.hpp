#pragma once
#include <cstdint>
#include <string>
#include <string_view>

#include "protocol/units/outcome.hpp"

namespace probebox::serial {

enum class Parity : std::uint8_t { none, even, odd };

struct Settings {
  unsigned baud{115200};
  Parity parity{Parity::none};
  unsigned data_bits{8};  // 7 or 8
  unsigned stop_bits{1};  // 1 or 2
};

// What both ends of a link to a host take when nobody names a speed.
inline constexpr Settings kHostLink{.baud = 921600};

struct Address {
  std::string path;
  Settings settings;
};

// "DEVICE[,baud=19200][,parity=even][,data=8][,stop=1]"; what is not named comes from `usual`.
Outcome<Address> parseAddress(std::string_view text, const Settings& usual = {});

// "19200 8E1"
std::string describe(const Settings& settings);

}  // namespace probebox::serial
