#pragma once
#include <array>
#include <chrono>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "drivers/io/descriptor.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::serial {

// Connects two pseudo terminals like two serial ports with a cable. Each port is a symbolic link with a stable name,
// opened like a device. Bytes move only inside pump().
class EmulatedCable {
 public:
  enum class End : std::size_t { a = 0, b = 1 };

  static Outcome<EmulatedCable> open(std::filesystem::path port_a, std::filesystem::path port_b);
  EmulatedCable(EmulatedCable&&) noexcept = default;
  EmulatedCable& operator=(EmulatedCable&&) noexcept = default;
  ~EmulatedCable();

  // Waits at most `patience` for bytes at either end and transfers them. Returns their number.
  std::size_t pump(std::chrono::milliseconds patience);

  // Makes noise bytes appear at this end.
  void inject(End at, std::span<const std::byte> noise);

  // While stalled, bytes are kept.
  void stall(bool stalled) { stalled_ = stalled; }

  // Echoes what this end sends, like an RS-485 adapter with its receiver enabled.
  void echo(End end, bool on) { ports_[static_cast<std::size_t>(end)].echoes = on; }

  // Removes this end's device, like a pulled USB adapter: processes that have it open see a hang-up. plug() restores it
  // under the same name.
  void unplug(End end);
  Outcome<void> plug(End end);

 private:
  struct Port {
    std::filesystem::path link;
    io::Descriptor controller;
    io::Descriptor device;           // held open: a program that leaves must not look like an unplugged cable
    std::vector<std::byte> waiting;  // for this end, not yet taken by the kernel
    bool echoes{};
  };

  EmulatedCable() = default;
  void collect(Port& from, Port& to);
  std::size_t deliver(Port& to);

  std::array<Port, 2> ports_;
  bool stalled_{};
};

}  // namespace probebox::serial
