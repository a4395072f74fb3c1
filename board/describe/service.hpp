#pragma once
#include <cstdint>
#include <string>
#include <vector>

// service.toml: how the box is reached, and what may be done over a link.
namespace probebox::board {

// Whatever is not named is not allowed.
struct Access {
  bool allow_marker{false};
  bool allow_calibrate{false};
  bool allow_accept{false};
};

struct StreamSettings {
  std::uint32_t block_samples{256};  // samples in a frame
  std::uint32_t ring_blocks{256};    // frames kept for a host that reads slowly
};

struct Service {
  std::vector<std::string> links;  // "tcp:127.0.0.1:7627", "serial:/dev/ttyS1"
  std::vector<std::string> cnc;    // "modbus:/dev/ttyS2,baud=19200,parity=even,unit=1"
  // Where a person finds each of them: "service.toml:3: 'links'".
  std::vector<std::string> link_places, cnc_places;
  Access access;
  StreamSettings stream;
};

}  // namespace probebox::board
