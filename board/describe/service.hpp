#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "board/describe/keys.hpp"

// Describes how the box is reached and what each link may do (service.toml).
namespace probebox::board {

// Lists the rights of a link or a line besides reading. Rights that are not named are not granted.
struct Access {
  bool allow_marker{}, allow_homing{}, allow_inhibit{}, allow_calibrate{}, allow_accept{}, allow_update{};
  // Write the identity of a box that has none, its keys, and others of the same people. Not named: over USB alone.
  std::optional<bool> allow_provision{};
  bool allow_other_people{};

  friend bool operator==(const Access&, const Access&) = default;

  static constexpr void keys(auto& self, auto&& key) {
    key("allow_marker", self.allow_marker, "begin and end steps, report the pose and the tool");
    key("allow_homing", self.allow_homing, "report the position of a homed axis");
    key("allow_inhibit", self.allow_inhibit, "declare that a cut begins or ends");
    key("allow_calibrate", self.allow_calibrate, "start and abort procedures, propose cases");
    key("allow_accept", self.allow_accept, "accept, roll back, switch sources");
    key("allow_update", self.allow_update, "hand over new firmware");
    key("allow_provision", self.allow_provision,
        "write the identity of a box that has none, and its keys; omitted: over USB alone");
    key("allow_other_people", self.allow_other_people,
        "with allow_provision, put another people.crt in the place of one");
  }
};

// Whether whoever has these rights may do anything but read.
bool givesARight(Access access);

// Returns the rights of hosts on USB: whoever holds the cable holds the box, and may provision it unless `named` says
// otherwise.
Access onUsb(Access named);

// Gives a link or a line rights of its own instead of those of [access].
struct Connection {
  std::string address;  // as in links or cnc
  bool read_only{};     // nothing but reading is allowed; required for a link that other computers can reach
  Access access;
};

// The keys of tls: links: files in PEM. Without names: those that the box was provisioned with.
struct TlsKeys {
  std::string certificate;            // of the box
  std::string key;                    // of that certificate
  std::string people_ca;              // whose certificates are taken for persons'
  std::vector<std::string> shut_out;  // certificates of persons that are refused: SHA-256, 64 hex digits in lower case

  bool areProvisioned() const { return certificate.empty(); }
};

// Gives whoever comes through a tls: link with a certificate of this name rights besides reading.
struct Person {
  std::string name;
  Access access;
};

struct StreamSettings {
  std::uint32_t block_samples{256}, ring_blocks{256};

  static constexpr void keys(auto& self, auto&& key) {
    key("block_samples", self.block_samples, within(1, 256).orUsual(), "samples in a frame");
    key("ring_blocks", self.ring_blocks, within(2, 4096).orUsual(), "frames kept for a host that reads slowly");
  }
};

struct Service {
  std::vector<std::string> links;  // "tcp:127.0.0.1:7627", "tls:0.0.0.0:7628", "serial:/dev/ttyS1"
  std::vector<std::string> cnc;    // "modbus:/dev/ttyS2,baud=19200,parity=even,unit=1"
  // Place of each in the file, for messages: "service.toml:3: 'links'".
  std::vector<std::string> link_places, cnc_places;
  Access access;  // of all that have no [[connection]], but tls: links
  std::vector<Connection> connections;
  std::optional<TlsKeys> tls;  // there where a link needs it
  std::vector<Person> people;
  StreamSettings stream;

  // Returns the entry of this address, or null.
  const Connection* connectionAt(std::string_view address) const;
  // Returns the rights of clients at this address.
  const Access& accessAt(std::string_view address) const;
  // Returns the rights of a person; those of nobody, who may read, where the person is not named here.
  Access accessOf(std::string_view person) const;
};

}  // namespace probebox::board
