#pragma once
#include <cstdint>

#include "protocol/events/event.hpp"

namespace probebox::box {

// Whether the positions that a controller tells go on from those before.
class ControlAxes {
 public:
  // Returns all axes that were told so far, as bits, when the controller began anew, else 0.
  std::uint8_t broken(const ControlPositions& positions) {
    const bool is_new_run = axes_ != 0 && positions.run != run_;
    run_ = positions.run;
    axes_ |= positions.axes;
    return is_new_run ? axes_ : std::uint8_t{0};
  }

 private:
  std::uint8_t run_{};
  std::uint8_t axes_{};
};

}  // namespace probebox::box
