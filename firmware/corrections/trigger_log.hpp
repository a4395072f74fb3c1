#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "firmware/corrections/axis_track.hpp"
#include "firmware/corrections/machine_tick.hpp"
#include "firmware/corrections/served.hpp"
#include "protocol/events/event.hpp"
#include "protocol/state/snapshot.hpp"

namespace probebox::corrections {

using published::TriggerStamp;

// Finds the ticks on both sides of each trigger and interpolates the machine position, and the angles of rotary axes
// between the latches of their encoders. Where a tick is of no sample, positions come from the counts on both sides of
// the trigger. Edges, ticks and latches may arrive in any order.
class TriggerLog {
 public:
  void push(const Edge& edge, const Served& served);
  void tick(const MachineTick& tick);
  // Takes the angle of a referenced encoder, as latched then. An axis without one has the angle of the tick.
  void turned(RotaryAxis axis, MonoTime at, double angle_rad);
  // Takes the position of a referenced linear axis, as counted then.
  void counted(Axis axis, MonoTime at, double position_mm);
  // The axis has no reference, or a new one: positions of before do not belong to those that follow.
  void forget(Axis axis) { paths_[static_cast<std::size_t>(axis)].clear(); }
  // Counts lag behind the lines by this delay.
  void setDelay(Axis axis, double tau_s);
  void encodersLost();

  // The last trigger whose position and angles are decided: known, or not obtainable.
  const TriggerStamp& newest() const { return newest_; }
  // Returns all triggers in order. When the caller is too slow the oldest are dropped, as are those that find the queue
  // full: gaps in the numbers show both.
  std::optional<TriggerStamp> next();
  // Number of the first trigger that next() may still return; all before it were returned or dropped.
  std::uint32_t nextNumber() const { return given_ < end_ ? waiting_[given_ % kWaiting].number : count_ + 1; }
  std::uint32_t unplaced() const { return unplaced_; }  // too many between two ticks, or nothing around them

 private:
  static constexpr std::size_t kWaiting = 16;
  static constexpr std::size_t kTicks = 32;

  void placeWaiting();
  bool awaitsCounts(const TriggerStamp& stamp, const MachineTick& newest) const;
  bool place(TriggerStamp& stamp) const;
  bool placeByCounts(TriggerStamp& stamp, const MachineTick& after) const;
  bool awaitsAngles(const TriggerStamp& stamp, MonoTime newest_tick) const;
  void turn(TriggerStamp& stamp) const;

  std::array<TriggerStamp, kWaiting> waiting_{};
  // Ring indices: next to return, next whose angles are open, next to place, end.
  std::size_t given_{}, first_{}, placed_{}, end_{};
  std::uint32_t count_{};
  std::uint32_t unplaced_{};
  TriggerStamp newest_;
  std::array<MachineTick, kTicks> ticks_{};
  std::size_t tick_count_{};
  std::array<AxisTrack, kRotaryAxes> tracks_{};
  std::array<AxisTrack, kLinearAxes> paths_{};
  std::array<Nanoseconds, kLinearAxes> tau_{};
};

}  // namespace probebox::corrections
