#include "tools/link/uri.hpp"

#include "drivers/serial/linux_serial.hpp"
#include "drivers/tcp/linux_tcp.hpp"
#include "drivers/tls/connection.hpp"
#include "drivers/usb_host/device.hpp"
#include "drivers/usb_host/usb_link.hpp"
#include "tools/link/own_keys.hpp"

namespace probebox::link {
namespace {

template <class Address>
Outcome<Uri> named(Outcome<Address> address, std::string_view text) {
  if (!address) return Error{std::string{text} + ": " + address.error().what};
  return Uri{std::move(*address), std::string{text}};
}

using Opened = Outcome<io::Connection, OpenFailure>;
using UsbKind = usb_host::OpenError::Kind;

Opened oneLane(Outcome<std::unique_ptr<io::BytePipe>> pipe) {
  if (!pipe) return OpenFailure{OpenFailure::Kind::no_box, pipe.error().what};
  return io::Connection{std::move(*pipe)};
}

// A host without brackets that has no colon, or "[IPv6]", has no port.
Outcome<TlsAddress> parseTls(std::string_view text) {
  const bool has_port = text.find(':') != std::string_view::npos && !text.ends_with(']');
  TRY(auto address,
      tcp::parseAddress(std::string{text} + (has_port ? "" : ":" + std::to_string(TlsAddress::kUsualPort))));
  return TlsAddress{std::move(address)};
}

Opened openTls(const TlsAddress& address, std::chrono::milliseconds patience) {
  const auto keys = ownKeys();
  if (!keys) return OpenFailure{OpenFailure::Kind::no_permission, keys.error().what};
  auto carrier = tcp::connectTcp(address.at, patience);
  if (!carrier) return OpenFailure{OpenFailure::Kind::no_box, carrier.error().what};
  return oneLane(tls::connect(*keys, std::move(*carrier), address.at.host, patience));
}

OpenFailure failureOf(const usb_host::OpenError& error) {
  switch (error.kind) {
    case UsbKind::no_permission:
      return {OpenFailure::Kind::no_permission, error.what};
    case UsbKind::busy:
      return {OpenFailure::Kind::busy, error.what};
    case UsbKind::ambiguous:
      return {OpenFailure::Kind::ambiguous, error.what};
    default:
      return {OpenFailure::Kind::no_box, error.what};
  }
}

}  // namespace

Outcome<Uri> parseUri(std::string_view text) {
  const auto colon = text.find(':');
  const auto scheme = text.substr(0, colon);
  const auto rest = colon == std::string_view::npos ? std::string_view{} : text.substr(colon + 1);
  if (scheme == "tcp") return named(tcp::parseAddress(rest), text);
  if (scheme == "tls") return named(parseTls(rest), text);
  if (scheme == "serial") {
    auto address = serial::parseAddress(rest, serial::kHostLink);
    if (address) {
      if (auto refused = serial::whyNoHostLink(*address)) return *std::move(refused);
    }
    return named(std::move(address), text);
  }
  if (scheme == "file") {
    if (rest.empty()) return Error{"file: names no recording; write file:REC.pbx"};
    return Uri{FileAddress{std::string{rest}}, std::string{text}};
  }
  if (scheme == "usb") return Uri{UsbAddress{std::string{rest}}, std::string{text}};
  return Error{"'" + std::string{text} +
               "' is not the address of a box; write tcp:HOST:PORT, tls:HOST[:PORT], serial:DEVICE[,baud=N], "
               "usb:SERIAL or file:REC.pbx"};
}

messages::Profile suitableProfile(const Uri& uri, const messages::Descriptor& box) {
  constexpr unsigned kMostBaud = 921'600;  // a box's processor keeps up with more than that brings
  const auto* line = std::get_if<serial::Address>(&uri.address);
  const bool is_slow = line != nullptr && line->settings.baud <= kMostBaud;
  return is_slow && box.samplesPerSecond() <= messages::kMostTight_Hz ? messages::Profile::tight
                                                                      : messages::Profile::fast;
}

Outcome<Uri, OpenFailure> settled(const Uri& uri) {
  const auto* usb = std::get_if<UsbAddress>(&uri.address);
  if (usb == nullptr || !usb->name.empty()) return uri;
  const auto context = usb_host::Context::open();
  if (!context) return failureOf(context.error());
  const auto device = usb_host::choose(usb_host::devices(*context, usb::kLink), {}, usb::kLink);
  if (!device) return failureOf(device.error());
  return Uri{UsbAddress{device->name()}, "usb:" + device->name()};
}

Outcome<io::Connection, OpenFailure> open(const Uri& uri, std::chrono::milliseconds patience) {
  if (const auto* tcp = std::get_if<tcp::Address>(&uri.address)) return oneLane(tcp::connectTcp(*tcp, patience));
  if (const auto* tls = std::get_if<TlsAddress>(&uri.address)) return openTls(*tls, patience);
  if (const auto* serial = std::get_if<serial::Address>(&uri.address)) {
    return oneLane(serial::openSerial(serial->path, serial->settings));
  }
  if (const auto* usb = std::get_if<UsbAddress>(&uri.address)) {
    auto link = usb_host::openUsbLink(usb->name);
    if (!link) return failureOf(link.error());
    return std::move(*link);
  }
  return OpenFailure{
      OpenFailure::Kind::no_box,
      uri.text + " is a recording and cannot be connected to; name a box by usb:, tcp:, tls: or serial:"};
}

}  // namespace probebox::link
