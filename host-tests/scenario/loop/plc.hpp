#pragma once
#include <array>
#include <cstdint>
#include <map>

#include "host-tests/emulation/register_link.hpp"
#include "tools/gcode/loop/areas.hpp"

namespace probebox::scenario {

// A PLC between box and control, as the head of a loop program asks for it: it reads areas in turn, and writes those
// whose commit has changed.
class Plc {
 public:
  explicit Plc(Registers box);

  void cycle();
  void setLine(bool connected) { connected_ = connected; }
  // The program reads that of this word from now on, whatever the box says.
  void feign(std::size_t at, std::uint16_t value) { feigned_[at] = value; }
  std::uint16_t word(std::size_t at) const { return words_.at(at); }
  void set(std::size_t at, std::uint16_t value) { words_.at(at) = value; }
  // The ladder of a Fanuc: one word for the program, asked for by UO100 to UO131 and answered by UI100 to UI131.
  std::uint32_t answer(std::uint32_t asked);
  unsigned refusedWrites() const { return refused_writes_; }

 private:
  void send(const gcode::loop::Area& area);

  Registers box_;
  bool connected_{true};
  std::array<std::uint16_t, 512> words_{};
  std::map<std::uint16_t, std::uint16_t> sent_;  // commit register: number that the box has answered
  std::map<std::size_t, std::uint16_t> feigned_;
  std::size_t next_{};
  std::uint32_t answered_{};
  unsigned refused_writes_{};
};

}  // namespace probebox::scenario
