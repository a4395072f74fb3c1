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
  } else if (key == "rs485" && (value == "kernel" || value == "none")) {
    settings.rs485 = value == "kernel";
  } else {
    return false;
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
                 ": known are baud=RATE, parity=none|even|odd, data=7|8, stop=1|2, rs485=kernel|none"};
  }
  return address;
}

std::string describe(const Settings& settings) {
  const char parity = settings.parity == Parity::none ? 'N' : settings.parity == Parity::even ? 'E' : 'O';
  return std::to_string(settings.baud) + " " + std::to_string(settings.data_bits) + parity +
         std::to_string(settings.stop_bits);
}

}  // namespace probebox::serial
