#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

// Describes how the box is reached and what each link may do (service.toml).
namespace probebox::board {

// Lists the rights of a link or a line besides reading. Rights that are not named are not granted.
struct Access {
  bool allow_marker{false};     // begin and end steps, report the pose and the tool
  bool allow_homing{false};     // report the position of a homed axis
  bool allow_inhibit{false};    // declare that a cut begins or ends
  bool allow_calibrate{false};  // start and abort procedures, propose cases
  bool allow_accept{false};     // accept, roll back, switch sources
  bool allow_update{false};     // hand over new firmware
  // Write the identity of a box that has none. Not named: over USB alone.
  std::optional<bool> allow_provision{};

  friend bool operator==(const Access&, const Access&) = default;
};

// Whether whoever has these rights may do anything but read.
bool givesARight(Access access);

// Returns the rights of hosts on USB: whoever holds the cable holds the box, and may provision it unless `named` says
// otherwise.
Access onUsb(Access named);

// Gives a link or a line rights of its own instead of those of [access].
struct Door {
  std::string address;  // as in links or cnc
  bool read_only{};     // nothing but reading is allowed; required for a link that other computers can reach
  Access access;
};

struct StreamSettings {
  std::uint32_t block_samples{256};  // samples in a frame
  std::uint32_t ring_blocks{256};    // frames kept for a host that reads slowly
};

struct Service {
  std::vector<std::string> links;  // "tcp:127.0.0.1:7627", "serial:/dev/ttyS1"
  std::vector<std::string> cnc;    // "modbus:/dev/ttyS2,baud=19200,parity=even,unit=1"
  // Place of each in the file, for messages: "service.toml:3: 'links'".
  std::vector<std::string> link_places, cnc_places;
  Access access;  // of all that have no door of their own
  std::vector<Door> doors;
  StreamSettings stream;

  // Returns the entry of this address, or null.
  const Door* doorAt(std::string_view address) const;
  // Returns the rights of clients at this address.
  const Access& accessAt(std::string_view address) const;
};

}  // namespace probebox::board
