#pragma once
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "drivers/io/byte_pipe.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::usb_gadget {

// Default paths of probebox-usb-setup.
struct PortAddress {
  std::filesystem::path function_fs{"/run/probebox-usb"};
  std::filesystem::path gadget{"/sys/kernel/config/usb_gadget/probebox"};
  std::string controller;  // empty: the first one
};

// Parses what follows "usb": "", ":controller=NAME", ":mount=DIR,gadget=DIR,controller=NAME".
Outcome<PortAddress> parsePort(std::string_view text);

struct PortCounters {
  std::uint64_t connections{};       // times that a host configured the box or selected the interface again
  std::uint64_t suspensions{};       // times that the bus was suspended
  std::uint64_t discarded_bytes{};   // perhaps not delivered, or not read, when a connection ended
  std::uint64_t failed_transfers{};  // while a connection was up
  std::uint64_t stalled_requests{};  // unknown control requests to this interface
};

// The box's end of USB: plays the function and returns a connection each time a host selects it. Never waits; one
// thread uses it and its pipes.
class GadgetPort {
 public:
  // Writes the descriptors and binds the gadget: the box appears on the bus.
  static Outcome<std::unique_ptr<GadgetPort>> open(const PortAddress& address);
  ~GadgetPort();
  GadgetPort(const GadgetPort&) = delete;
  GadgetPort& operator=(const GadgetPort&) = delete;

  // Readable when turn() has work, for the port and its connection's pipes.
  int descriptor() const;

  // Handles bus events. The pipes of an ended connection are closed afterwards.
  void turn();

  // The connection made since the last call, at most one at a time.
  std::optional<io::Connection> accept();

  PortCounters counters() const;

 private:
  struct Bus;
  explicit GadgetPort(std::shared_ptr<Bus> bus);
  std::shared_ptr<Bus> bus_;
};

}  // namespace probebox::usb_gadget
