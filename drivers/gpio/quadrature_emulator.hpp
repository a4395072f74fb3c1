#pragma once
#include <array>
#include <cstdint>
#include <deque>
#include <string>

#include "drivers/gpio/quadrature.hpp"
#include "drivers/io/event_source.hpp"

namespace probebox::gpio {

// Emulates the lines A and B of an incremental encoder on a gpio chip: takes positions in counts and delivers edges,
// after the levels of the lines at the request. A full queue drops its oldest edge, as the kernel does.
class EmulatedQuadrature final : public io::EventSource {
 public:
  explicit EmulatedQuadrature(std::size_t queue_edges = 1024) : most_edges_{queue_edges} {}

  // Turns the encoder at constant speed from its present count so that it reaches `count` at `at`, which must not
  // decrease.
  void turnTo(std::int64_t count, MonoTime at);
  // Exchanges A and B at the connector.
  void exchangeLines() { exchanged_ = !exchanged_; }
  // Hides the next edges from the kernel, as pulses that are too short.
  void hideEdges(unsigned edges) { to_hide_ = edges; }

  // Unplugs the chip, and plugs it in again.
  void disconnect();
  void reconnect() { is_connected_ = true, levels_unreported_ = true; }

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
  bool levels_unreported_{true};
  bool loss_unreported_{};
  std::uint64_t lost_edges_{};
};

}  // namespace probebox::gpio
