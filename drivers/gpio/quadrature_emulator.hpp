#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <string>

#include "drivers/gpio/quadrature.hpp"
#include "drivers/io/event_source.hpp"

namespace probebox::gpio {

// Emulates the lines A and B of an incremental encoder on a gpio chip: positions in counts go in, and edges come out,
// after the levels that the lines had when they were requested. A full queue loses its oldest edge, as the kernel's.
class EmulatedQuadrature final : public io::EventSource {
 public:
  explicit EmulatedQuadrature(std::size_t queue_edges = 1024) : most_edges_{queue_edges} {}

  // Turns the encoder from where it is, at constant speed, so that it arrives at `count` at `at`, which must not
  // decrease.
  void turnTo(std::int64_t count, MonoTime at);
  // A and B are exchanged at the connector from now on.
  void exchangeLines() { exchanged_ = !exchanged_; }
  // The kernel does not see the next edges: they were too short for it.
  void hideEdges(unsigned edges) { to_hide_ = edges; }

  // Unplugs the chip, and plugs it in again.
  void disconnect();
  void reconnect() { is_connected_ = true, levels_untold_ = true; }

  std::size_t read(std::span<Event> into, MonoTime now) override;
  int descriptor() const override { return -1; }
  std::string_view name() const override { return "emulated lines"; }

  std::uint64_t lostEdges() const { return lost_edges_; }

 private:
  void drive(std::size_t line, bool high, MonoTime at);
  Edge edgeOf(std::size_t line, MonoTime at) const;

  std::size_t most_edges_;
  std::int64_t count_{};
  MonoTime at_{};
  std::array<bool, 2> high_{};
  std::array<std::uint32_t, 2> sequence_{};
  std::deque<Edge> queue_;
  bool exchanged_{};
  unsigned to_hide_{};
  bool is_connected_{true};
  bool levels_untold_{true};
  bool loss_untold_{};
  std::uint64_t lost_edges_{};
};

}  // namespace probebox::gpio
