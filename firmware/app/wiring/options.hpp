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
#include "firmware/store/set_aside.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Options of the command line of probeboxd.
struct Options {
  std::string board = "sim";
  std::filesystem::path state;   // folder for data that survive a restart; empty: the default
  std::filesystem::path config;  // folder of descriptions that replace the board's; empty: none
  std::filesystem::path solver;  // the program that solves cases; empty: the worker's thread solves them
  std::vector<std::string> links;
  std::vector<std::string> cnc;
  std::filesystem::path journal;  // empty: none
  std::filesystem::path init;     // folder in which to write starting descriptions; empty: none
  std::filesystem::path updater;  // folder where the program that installs updates reports; empty: there is none
  std::filesystem::path
      confirmed;  // file that is there once the running version was found healthy; empty: it always is
  double time_scale = 1.0;
  bool check = false;
  bool usb_identity = false;
};

// Where a listener takes hosts that prove who they are, by TLS.
struct TlsAddress {
  tcp::Address at;
};

// Address of a link for hosts.
using LinkAddress = std::variant<tcp::Address, TlsAddress, serial::Address, usb_gadget::PortAddress>;
// "tcp:HOST:PORT", "tls:HOST:PORT", "serial:DEVICE[,baud=..]" or "usb".
Outcome<LinkAddress> parseLink(const std::string& text);

// The folder for data that survive a restart, locked by one daemon at a time.
struct StateDirectory {
  std::filesystem::path path;
  io::Descriptor lock;
  std::string notice{};  // why nothing can be stored there; empty if it can
};
// The folder that takeStateDirectory() takes, without making or locking it.
std::filesystem::path stateDirectory(const std::filesystem::path& chosen);

// Takes --state, or $STATE_DIRECTORY (systemd), or ~/.local/state/probebox. Makes it when missing; error when another
// daemon has it. A full, read-only or broken disk is no error: the box then runs and stores nothing.
Outcome<StateDirectory> takeStateDirectory(const std::filesystem::path& chosen);

// The file of the state directory that a start makes last.
inline constexpr const char* kBootsFile = "boots";

// What earlier starts have left in the state directory.
struct Earlier {
  store::Before start;  // one that had made all files
  store::Before files;  // any of them
};

Earlier earlierIn(const std::filesystem::path& state);

}  // namespace probebox::app
