#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "drivers/gpio/decode.hpp"
#include "drivers/gpio/lines.hpp"
#include "drivers/gpio/loss.hpp"
#include "drivers/io/event_source.hpp"

namespace probebox::gpio {

// Emulates the kernel's character device of a gpio chip: physical levels in, edges out, through a bounded queue. When
// the queue is full the oldest edge is lost and the line's sequence continues, as in Linux.
class EmulatedGpio final : public io::EventSource {
 public:
  // The lines' addresses must be offsets. All start low, or high where `low` is the active level.
  explicit EmulatedGpio(const ChipLines& chip, std::size_t queue_edges = 1024);

  // Sets the wire to this level at `at`, which must not decrease. An unchanged level makes no edge.
  void drive(unsigned offset, bool high, MonoTime at);

  // Unplugs the chip, discarding its queue, and plugs it in again.
  void disconnect();
  void reconnect();

  // Edges that are due.
  std::size_t read(std::span<Event> into, MonoTime now) override;
  int descriptor() const override { return -1; }
  std::string_view name() const override { return name_; }

  std::uint64_t lostEdges() const { return lost_edges_; }

 private:
  struct Wire {
    WatchedLine line;
    bool high{};
    std::uint32_t sequence{};
  };

  void push(const RawEdge& edge);

  std::string name_;
  std::vector<Wire> wires_;
  EdgeDecoder decoder_;
  LossNotice loss_;
  std::vector<RawEdge> queue_;  // a ring
  std::size_t first_{};
  std::size_t size_{};
  std::uint64_t lost_edges_{};
  bool connected_{true};
};

}  // namespace probebox::gpio
