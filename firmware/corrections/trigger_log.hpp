#pragma once
#include <array>
#include <cstdint>

#include "firmware/corrections/machine_tick.hpp"
#include "firmware/corrections/served.hpp"
#include "protocol/events/event.hpp"

namespace probebox::corrections {

// A trigger, where the machine was at it, and the correction that was active then: whoever measures with it and then
// corrects by it would correct twice without the last.
struct TriggerStamp {
  std::uint32_t number{};  // from 1; 0: there was none
  std::uint8_t line{};
  MonoTime at{};
  std::array<bool, kLinearAxes> has_position{};
  std::array<double, kLinearAxes> position_mm{};  // machine position, the correction in it
  Served served;
};

// Finds the ticks on both sides of each trigger and interpolates between them. Edges and ticks come in any order.
class TriggerLog {
 public:
  void push(const Edge& edge, const Served& served);
  void tick(const MachineTick& tick);

  // The last one that could be placed, or could not for good.
  const TriggerStamp& newest() const { return newest_; }
  std::uint32_t unplaced() const { return unplaced_; }  // too many between two ticks, or no ticks around them

 private:
  static constexpr std::size_t kWaiting = 16;
  static constexpr std::size_t kTicks = 32;

  void placeWaiting();
  bool place(TriggerStamp& stamp) const;

  std::array<TriggerStamp, kWaiting> waiting_{};
  std::size_t first_{}, end_{};
  std::uint32_t count_{};
  std::uint32_t unplaced_{};
  TriggerStamp newest_;
  std::array<MachineTick, kTicks> ticks_{};
  std::size_t tick_count_{};
};

}  // namespace probebox::corrections
