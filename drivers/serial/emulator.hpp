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

// Two serial ports joined by a cable, made of two pseudo terminals. Each port is a symbolic link of a stable name, so
// that programs open it like a device. Bytes move only inside pump(): the cable is as patient as its owner.
class EmulatedCable {
 public:
  enum class End : std::size_t { a = 0, b = 1 };

  static Outcome<EmulatedCable> open(std::filesystem::path port_a, std::filesystem::path port_b);
  EmulatedCable(EmulatedCable&&) noexcept = default;
  EmulatedCable& operator=(EmulatedCable&&) noexcept = default;
  ~EmulatedCable();

  // Waits at most `patience` for bytes at either end and carries them over. Returns how many arrived.
  std::size_t pump(std::chrono::milliseconds patience);

  // Bytes that nobody sent appear at this end.
  void inject(End at, std::span<const std::byte> noise);

  // While stalled, bytes wait where they are.
  void stall(bool stalled) { stalled_ = stalled; }

  // What this end sends also comes back to it, as from an RS-485 adapter whose receiver stays on.
  void echo(End end, bool on) { ports_[static_cast<std::size_t>(end)].echoes = on; }

  // This end's device vanishes, as when a USB adapter is pulled: whoever has it open sees a hang-up. plug() brings it
  // back under the same name.
  void unplug(End end);
  Outcome<bool> plug(End end);

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
