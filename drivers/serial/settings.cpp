#include "drivers/serial/settings.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <optional>

namespace probebox::serial {
namespace {

std::optional<unsigned> wholeNumber(std::string_view text) {
  unsigned value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

std::optional<Parity> parityOf(std::string_view text) {
  if (text == "none" || text == "N" || text == "n") return Parity::none;
  if (text == "even" || text == "E" || text == "e") return Parity::even;
  if (text == "odd" || text == "O" || text == "o") return Parity::odd;
  return std::nullopt;
}

// The standard rate that is nearest by ratio.
unsigned nearestRate(unsigned baud) {
  const auto distance = [baud](unsigned rate) { return std::abs(std::log(double{1} * rate / std::max(baud, 1U))); };
  return *std::ranges::min_element(kRates, {}, distance);
}

// False: the option is not one of RS-485, or its value is not one that it can have.
bool applyTurning(std::string_view key, std::string_view value, Rs485& rs485) {
  constexpr std::string_view kGpio{"gpio:"};
  const auto number = wholeNumber(value);
  const bool is_delay = number && *number <= kMostTurning_ms;
  if (key == "rs485" && value.starts_with(kGpio) && value.size() > kGpio.size()) {
    rs485.by = Turning::gpio;
    rs485.gpio = value.substr(kGpio.size());
  } else if (key == "rs485" && (value == "none" || value == "kernel" || value == "rts")) {
    rs485.by = value == "none" ? Turning::none : value == "rts" ? Turning::rts : Turning::kernel;
  } else if (key == "rs485_active" && (value == "high" || value == "low")) {
    rs485.active_high = value == "high";
  } else if (key == "rs485_before_ms" && is_delay) {
    rs485.before_ms = *number;
  } else if (key == "rs485_after_ms" && is_delay) {
    rs485.after_ms = *number;
  } else {
    return false;
  }
  return true;
}

// False: the option is not known, or its value is not one that a line can have.
bool apply(std::string_view key, std::string_view value, Settings& settings) {
  const auto number = wholeNumber(value);
  if (key == "baud" && number) {
    settings.baud = *number;
  } else if (const auto parity = parityOf(value); key == "parity" && parity) {
    settings.parity = *parity;
  } else if (key == "data" && (number == 7U || number == 8U)) {
    settings.data_bits = *number;
  } else if (key == "stop" && (number == 1U || number == 2U)) {
    settings.stop_bits = *number;
  } else {
    return applyTurning(key, value, settings.rs485);
  }
  return true;
}

}  // namespace

Outcome<Address> parseAddress(std::string_view text, const Settings& usual) {
  const auto comma = text.find(',');
  Address address{std::string{text.substr(0, comma)}, usual};
  if (address.path.empty()) return Error{"a serial line needs its device: write /dev/ttyS1,baud=19200"};
  auto rest = comma == std::string_view::npos ? std::string_view{} : text.substr(comma + 1);
  while (!rest.empty()) {
    const auto option = rest.substr(0, rest.find(','));
    rest.remove_prefix(std::min(rest.size(), option.size() + 1));
    const auto equals = option.find('=');
    const bool good = equals != std::string_view::npos &&
                      apply(option.substr(0, equals), option.substr(equals + 1), address.settings);
    const unsigned baud = address.settings.baud;
    if (good && std::ranges::find(kRates, baud) == kRates.end())
      return Error{address.path + ": " + std::to_string(baud) +
                   " baud is not a standard rate: did you mean baud=" + std::to_string(nearestRate(baud)) + "?"};
    if (good) continue;
    return Error{"'" + std::string{option} + "' is not a setting of " + address.path +
                 ": known are baud=RATE, parity=none|even|odd, data=7|8, stop=1|2, rs485=none|kernel|rts|gpio:LINE, "
                 "rs485_active=high|low, rs485_before_ms=0..100, rs485_after_ms=0..100"};
  }
  const auto& rs485 = address.settings.rs485;
  if (rs485.by == Turning::none && rs485 != Rs485{.gpio = rs485.gpio})
    return Error{address.path +
                 ": rs485_active and the delays are of a transceiver that somebody turns: add rs485=kernel, "
                 "rs485=rts or rs485=gpio:LINE, or leave them out"};
  return address;
}

std::optional<Error> whyNoHostLink(const Address& address) {
  const auto by = address.settings.rs485.by;
  if (by != Turning::rts && by != Turning::gpio) return std::nullopt;
  return Error{address.path +
               ": rs485=rts and rs485=gpio are for lines of a controller, of which one end sends at a time: a "
               "host and a box send at the same time; take RS-232, RS-422 or USB, and leave the setting out"};
}

std::string describe(const Settings& settings) {
  const char parity = settings.parity == Parity::none ? 'N' : settings.parity == Parity::even ? 'E' : 'O';
  return std::to_string(settings.baud) + " " + std::to_string(settings.data_bits) + parity +
         std::to_string(settings.stop_bits);
}

}  // namespace probebox::serial
