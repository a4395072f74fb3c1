#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "board/describe/box.hpp"
#include "protocol/events/event.hpp"

namespace probebox::gpio {

// One edge as reported by the kernel.
struct RawEdge {
  unsigned offset{};
  bool rising{};
  std::int64_t timestamp_ns{};    // CLOCK_MONOTONIC
  std::uint32_t line_sequence{};  // counts this line's edges since the line was requested, from 1
};

// Edges requested for a line: one direction for ticks and reference marks, both for touches and skips.
enum class Edges : std::uint8_t { active, both };

// A line of one chip and its role in the box.
struct WatchedLine {
  unsigned offset{};
  LineRole role{};
  std::uint8_t line{};  // number within the role; the axis of an index line
  board::ActiveLevel active{board::ActiveLevel::high};
  Edges edges{Edges::both};
};

constexpr Edges edgesOf(LineRole role) {
  return role == LineRole::sync || role == LineRole::index ? Edges::active : Edges::both;
}

// Decodes kernel edges to events: roles, polarity and sequence numbers. Pure; allocates in the constructor only.
class EdgeDecoder {
 public:
  explicit EdgeDecoder(std::vector<WatchedLine> lines);

  // Returns nullopt for an edge of a line that is not watched; such edges are counted.
  std::optional<Edge> decode(const RawEdge& raw);

  // Makes an event from the present level of a line, with the last known sequence, so that no loss is counted. nullopt
  // for a line that is not watched. The caller sets the stamp.
  std::optional<Edge> found(unsigned offset, bool high) const;

  // Call after the lines were requested anew: the kernel counts from 1 again, and sequences continue. Losses in between
  // are unknown and reported by SourceLost. `lines`: the same in the same order; offsets may have changed.
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
