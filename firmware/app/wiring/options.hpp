#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "drivers/io/descriptor.hpp"
#include "drivers/serial/settings.hpp"
#include "drivers/tcp/address.hpp"
#include "drivers/usb_gadget/gadget_port.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Options of the command line of probeboxd.
struct Options {
  std::string board = "sim";
  std::filesystem::path state;   // folder of what must survive a restart; empty: the default
  std::filesystem::path config;  // folder of descriptions that replace the board's; empty: none
  std::filesystem::path solver;  // the program that solves cases; empty: the worker's thread does it itself
  std::vector<std::string> links;
  std::vector<std::string> cnc;
  std::filesystem::path journal;  // empty: none
  std::filesystem::path init;     // folder that gets descriptions to begin with; empty: none
  double time_scale = 1.0;
  bool check = false;
  bool usb_identity = false;
};

// Address of a link for hosts.
using LinkAddress = std::variant<tcp::Address, serial::Address, usb_gadget::PortAddress>;
// "tcp:HOST:PORT", "serial:DEVICE[,baud=..]" or "usb".
Outcome<LinkAddress> parseLink(const std::string& text);

// The folder for data that survive a restart, locked by one daemon at a time.
struct StateDirectory {
  std::filesystem::path path;
  io::Descriptor lock;
  std::string notice{};  // why nothing can be kept there; empty when all is well
};
// --state, or $STATE_DIRECTORY (systemd), or ~/.local/state/probebox. Made when missing; an error when another daemon
// has it. A disk that is full, read-only or broken is no error: the box then runs and keeps nothing.
Outcome<StateDirectory> takeStateDirectory(const std::filesystem::path& chosen);

}  // namespace probebox::app
