#pragma once
#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/tcp/linux_tcp.hpp"

namespace probebox::tcp {

// Faults of a wire. The same seed has the same effect on the same bytes, independent of packets.
struct WireFaults {
  std::uint64_t seed{};
  double corrupt_probability{};
  double drop_probability{};
};

struct WireCounts {
  std::uint64_t carried{};
  std::uint64_t corrupted{};
  std::uint64_t dropped{};
};

// Relays between hosts and a box, with cuts, stalls and noise. Hosts connect to address(); each is relayed to `box`.
// Bytes move only inside pump().
class EmulatedWire {
 public:
  static Outcome<EmulatedWire> open(const Address& listen_at, Address box);

  const Address& address() const { return listener_.address(); }

  // Waits at most `patience` for an event and handles it. Returns the number of bytes.
  std::size_t pump(std::chrono::milliseconds patience);

  void disturb(const WireFaults& towards_host, const WireFaults& towards_box);
  void stall(bool stalled) { stalled_ = stalled; }
  void cut() { connections_.clear(); }

  const WireCounts& towardsHost() const { return directions_[0].counts; }

 private:
  struct Direction {
    WireFaults faults{};
    std::uint64_t random{};
    WireCounts counts{};
  };
  struct Connection {
    std::array<std::unique_ptr<io::BytePipe>, 2> ends;  // host, box
    std::array<std::vector<std::byte>, 2> waiting;      // for that end
    bool closed{};
  };

  EmulatedWire(Listener listener, Address box) : listener_{std::move(listener)}, box_{std::move(box)} {}
  void welcome();
  void wait(std::chrono::milliseconds patience) const;
  std::size_t carry(Connection& connection, std::size_t to);
  void damage(Direction& direction, std::span<const std::byte> bytes, std::vector<std::byte>& out);

  Listener listener_;
  Address box_;
  std::vector<Connection> connections_;
  std::array<Direction, 2> directions_{};
  bool stalled_{};
};

}  // namespace probebox::tcp
