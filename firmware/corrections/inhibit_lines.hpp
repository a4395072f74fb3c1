#pragma once
#include <cstddef>
#include <cstdint>

#include "protocol/events/event.hpp"

namespace probebox::corrections {

// Levels of the lines that are active during a cut. From await() on, a described line whose level has never come counts
// as active: a box that cannot read it does not know that no cut is on. A line that is lost later keeps its last level.
class InhibitLines {
 public:
  static constexpr std::size_t kMost = 32;

  // described: number of lines, which are numbered from 0.
  explicit InhibitLines(std::size_t described)
      : described_{described < kMost ? (1U << described) - 1U : ~std::uint32_t{}} {}

  void push(const Edge& edge) {
    const std::uint32_t bit = 1U << (edge.line % kMost);
    known_ |= bit;
    active_ = edge.level == Level::active ? active_ | bit : active_ & ~bit;
  }
  // Call when all that was in force before the start has been told: that is no change, and no cut keeps it out.
  void await() { awaited_ = described_; }

  // One bit per line whose level has not come yet.
  std::uint32_t unknown() const { return awaited_ & ~known_; }
  bool isActive() const { return active_ != 0; }
  bool cutIsOn() const { return (active_ | unknown()) != 0; }

 private:
  std::uint32_t described_{};
  std::uint32_t awaited_{};
  std::uint32_t known_{};
  std::uint32_t active_{};
};

}  // namespace probebox::corrections
