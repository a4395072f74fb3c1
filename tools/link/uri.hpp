#pragma once
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <variant>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/serial/settings.hpp"
#include "drivers/tcp/address.hpp"
#include "protocol/messages/handshake.hpp"
#include "protocol/messages/types.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::link {

// A recording; "-" is the standard input.
struct FileAddress {
  std::string path;
};

// A box on USB by its serial number, or by its place ("1-1.4") where there is none; empty: the only one.
struct UsbAddress {
  std::string name;
};

// A box's door for persons with a certificate.
struct TlsAddress {
  static constexpr std::uint16_t kUsualPort = 7628;
  tcp::Address at;  // its host as the box's certificate has it
};

// tcp:HOST:PORT | tls:HOST[:PORT] | serial:DEVICE[,baud=N] | usb[:SERIAL] | file:RECORDING.pbx
struct Uri {
  std::variant<tcp::Address, TlsAddress, serial::Address, UsbAddress, FileAddress> address;
  std::string text;

  bool isFile() const { return std::holds_alternative<FileAddress>(address); }
};

Outcome<Uri> parseUri(std::string_view text);

// The profile for a host that has no wish: tight where the line is what limits the samples, and the box can send it.
messages::Profile suitableProfile(const Uri& uri, const messages::Descriptor& box);

// Explains why there is no connection; `what` has the remedy.
struct OpenFailure {
  enum class Kind : std::uint8_t {
    no_box,         // nothing answers there
    no_permission,  // this user may not open the device
    busy,           // another program uses the device
    ambiguous,      // there are several boxes, and none was named
  };
  Kind kind{};
  std::string what{};
};

// Replaces `usb` by usb:SERIAL, so that later connections reach the same box; other URIs stay unchanged.
Outcome<Uri, OpenFailure> settled(const Uri& uri);

// Connects to a box. Not for files: readRecording() reads them.
Outcome<io::Connection, OpenFailure> open(const Uri& uri, std::chrono::milliseconds patience);

}  // namespace probebox::link
