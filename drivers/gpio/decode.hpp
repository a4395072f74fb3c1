#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "board/describe/box.hpp"
#include "protocol/events/event.hpp"

namespace probebox::gpio {

// One edge as the kernel tells it.
struct RawEdge {
  unsigned offset{};
  bool rising{};
  std::int64_t timestamp_ns{};    // CLOCK_MONOTONIC
  std::uint32_t line_sequence{};  // counts this line's edges since the line was requested, from 1
};

// Which edges of a line are asked for. Ticks and reference marks need one, touches and skips both.
enum class Edges : std::uint8_t { active, both };

// A line of one chip and its role in the box.
struct WatchedLine {
  unsigned offset{};
  LineRole role{};
  std::uint8_t line{};  // which of that role; for an index line the axis
  board::ActiveLevel active{board::ActiveLevel::high};
  Edges edges{Edges::both};
};

constexpr Edges edgesOf(LineRole role) {
  return role == LineRole::sync || role == LineRole::index ? Edges::active : Edges::both;
}

// Roles, polarity and sequence numbers. Pure: no chip, no clock; allocates at construction only.
class EdgeDecoder {
 public:
  explicit EdgeDecoder(std::vector<WatchedLine> lines);

  // Nothing for an edge of a line that is not watched; such edges are counted.
  std::optional<Edge> decode(const RawEdge& raw);

  // A line's level as it was found, with the last known sequence, so that no loss is claimed. Nothing for a line
  // that is not watched. Its stamp is for the caller to set.
  std::optional<Edge> found(unsigned offset, bool high) const;

  // The lines were requested anew, so the kernel counts from 1 again: sequences go on where they were, because what was
  // lost meanwhile is unknown and told by SourceLost.
  // `lines` are the same in the same order; their offsets may have changed.
  void restart(std::span<const WatchedLine> lines);

  std::uint64_t unknownEdges() const { return unknown_edges_; }

 private:
  struct Watched {
    WatchedLine line;
    std::uint32_t sequence_base{};
    std::uint32_t last_sequence{};
  };
  std::vector<Watched> lines_;
  std::uint64_t unknown_edges_{};
};

}  // namespace probebox::gpio
