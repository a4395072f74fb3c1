#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "firmware/corrections/machine_tick.hpp"
#include "firmware/corrections/served.hpp"
#include "firmware/published/snapshot.hpp"
#include "protocol/events/event.hpp"

namespace probebox::corrections {

using published::TriggerStamp;

// Finds the ticks on both sides of each trigger and interpolates between them. Edges and ticks come in any order.
class TriggerLog {
 public:
  void push(const Edge& edge, const Served& served);
  void tick(const MachineTick& tick);

  // The last one that could be placed, or could not for good.
  const TriggerStamp& newest() const { return newest_; }
  // All of them, one after the other; the oldest of many that nobody takes is left out, and so is one that finds too
  // many waiting: their numbers tell.
  std::optional<TriggerStamp> next();
  // Of the first one that next() may still give: all before it were given, or left out.
  std::uint32_t nextNumber() const { return given_ < end_ ? waiting_[given_ % kWaiting].number : count_ + 1; }
  std::uint32_t unplaced() const { return unplaced_; }  // too many between two ticks, or no ticks around them

 private:
  static constexpr std::size_t kWaiting = 16;
  static constexpr std::size_t kTicks = 32;

  void placeWaiting();
  bool place(TriggerStamp& stamp) const;

  std::array<TriggerStamp, kWaiting> waiting_{};
  std::size_t given_{}, first_{}, end_{};  // of the ring: not given yet, not placed yet
  std::uint32_t count_{};
  std::uint32_t unplaced_{};
  TriggerStamp newest_;
  std::array<MachineTick, kTicks> ticks_{};
  std::size_t tick_count_{};
};

}  // namespace probebox::corrections
