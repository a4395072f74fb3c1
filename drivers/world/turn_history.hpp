#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "protocol/units/time.hpp"

namespace probebox::world {

// Remembers the latest turns of an axis for late readers, each at constant speed. Before the oldest the axis stands
// where that one starts.
class TurnHistory {
 public:
  static constexpr std::size_t kRemembered = 512;

  void append(double to_rad, MonoTime from, MonoTime until);
  // Angle at the instant `delay_s` before `at`.
  double angleAt(MonoTime at, double delay_s = 0) const;

 private:
  struct Turn {
    MonoTime from{}, until{};
    double from_rad{}, to_rad{};
  };
  std::array<Turn, kRemembered> turns_{};
  std::uint64_t count_{};
  double to_rad_{};  // where the last turn ends
};

}  // namespace probebox::world
