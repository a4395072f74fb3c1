#pragma once
#include <chrono>
#include <memory>
#include <string>
#include <string_view>
#include <variant>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/serial/settings.hpp"
#include "drivers/tcp/address.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::link {

// A recording; "-" is the standard input.
struct FileAddress {
  std::string path;
};

// tcp:HOST:PORT | serial:DEVICE[,baud=N] | file:RECORDING.pbx
struct Uri {
  std::variant<tcp::Address, serial::Address, FileAddress> address;
  std::string text;

  bool isFile() const { return std::holds_alternative<FileAddress>(address); }
};

// Fails for what is no URI, and for usb:, which this build does not know yet.
Outcome<Uri> parseUri(std::string_view text);

// Connects to a box. A file is no box: it is read by readRecording().
Outcome<io::Connection> open(const Uri& uri, std::chrono::milliseconds patience);

}  // namespace probebox::link
