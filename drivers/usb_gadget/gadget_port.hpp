#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "drivers/io/byte_pipe.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::usb_gadget {

// Where probebox-usb-setup puts things.
struct PortAddress {
  std::filesystem::path function_fs{"/run/probebox-usb"};
  std::filesystem::path gadget{"/sys/kernel/config/usb_gadget/probebox"};
  std::string controller;  // empty: the first there is
};

// "usb", "usb:controller=NAME", "usb:mount=DIR,gadget=DIR,controller=NAME": what comes after "usb".
Outcome<PortAddress> parsePort(std::string_view text);

struct PortCounters {
  std::uint64_t connections{};       // a host configured the box, or selected the interface anew
  std::uint64_t suspensions{};       // the bus fell asleep
  std::uint64_t discarded_bytes{};   // not known to have arrived, or not read, when a connection ended
  std::uint64_t failed_transfers{};  // while a connection was up
  std::uint64_t stalled_requests{};  // control requests that this interface does not know
};

// The box's end of USB: plays the link's function and hands out a connection each time that a host selects it. Nothing
// here ever waits; one thread uses it and its pipes.
class GadgetPort {
 public:
  // Writes the descriptors and binds the gadget: the box appears on the bus.
  static Outcome<std::unique_ptr<GadgetPort>> open(const PortAddress& address);
  ~GadgetPort();
  GadgetPort(const GadgetPort&) = delete;
  GadgetPort& operator=(const GadgetPort&) = delete;

  // Readable when turn() has something to do: for the port and for the pipes of its connection.
  int descriptor() const;

  // Takes what the bus has done. The pipes of a connection that has ended are closed after it.
  void turn();

  // The connection that has come since the last call. There is one at a time.
  std::optional<io::Connection> accept();

  PortCounters counters() const;

 private:
  struct Bus;
  explicit GadgetPort(std::shared_ptr<Bus> bus);
  std::shared_ptr<Bus> bus_;
};

}  // namespace probebox::usb_gadget
