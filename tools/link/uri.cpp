#include "tools/link/uri.hpp"

#include "drivers/serial/linux_serial.hpp"
#include "drivers/tcp/linux_tcp.hpp"

namespace probebox::link {
namespace {

template <class Address>
Outcome<Uri> named(Outcome<Address> address, std::string_view text) {
  if (!address) return Error{std::string{text} + ": " + address.error().what};
  return Uri{std::move(*address), std::string{text}};
}

Outcome<io::Connection> oneLane(Outcome<std::unique_ptr<io::BytePipe>> pipe) {
  if (!pipe) return pipe.error();
  return io::Connection{std::move(*pipe)};
}

}  // namespace

Outcome<Uri> parseUri(std::string_view text) {
  const auto colon = text.find(':');
  const auto scheme = text.substr(0, colon);
  const auto rest = colon == std::string_view::npos ? std::string_view{} : text.substr(colon + 1);
  if (scheme == "tcp") return named(tcp::parseAddress(rest), text);
  if (scheme == "serial") {
    return named(serial::parseAddress(rest, serial::kHostLink), text);
  }
  if (scheme == "file") {
    if (rest.empty()) return Error{"file: names no recording; write file:REC.pbx"};
    return Uri{FileAddress{std::string{rest}}, std::string{text}};
  }
  if (scheme == "usb") {
    return Error{std::string{text} + ": usb is not in this build yet; connect by tcp:HOST:PORT or serial:DEVICE"};
  }
  return Error{"'" + std::string{text} +
               "' is no address of a box; write tcp:HOST:PORT, serial:DEVICE[,baud=N] or file:REC.pbx"};
}

Outcome<io::Connection> open(const Uri& uri, std::chrono::milliseconds patience) {
  if (const auto* tcp = std::get_if<tcp::Address>(&uri.address)) return oneLane(tcp::connectTcp(*tcp, patience));
  if (const auto* serial = std::get_if<serial::Address>(&uri.address)) {
    return oneLane(serial::openSerial(serial->path, serial->settings));
  }
  return Error{uri.text + " is a recording and cannot be connected to; name a box by tcp: or serial:"};
}

}  // namespace probebox::link
