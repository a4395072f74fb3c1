#pragma once
#include <cstdint>

#include "firmware/latch/trace.hpp"
#include "protocol/events/event.hpp"

namespace probebox::latch {

// State of lines and markers at a sample's time, as bits of Channel::flags. Changes are queued until a sample passes
// them.
class LineState {
 public:
  enum class Pushed : std::uint8_t { taken, late, overwrote };

  Pushed push(const Edge& edge);
  Pushed push(const Marker& marker);

  // Applies all changes up to and including `t`. Decreasing times have no effect.
  void passTo(MonoTime t);

  // Returns the bits and clears those that mean "since the previous record".
  std::int64_t take();

 private:
  enum class Kind : std::uint8_t { trigger, skip, index, step };
  struct Change {
    Kind kind{};
    std::uint8_t line{};
    bool active{};
  };
  static constexpr std::size_t kCapacity = 256;

  Pushed push(MonoTime at, Change change);
  void apply(Change change);

  Trace<Change> changes_{kCapacity};
  MonoTime passed_{MonoTime::min()};
  std::uint32_t touching_{};  // one bit per trigger line
  std::uint32_t skipping_{};
  bool step_{};
  std::int64_t since_record_{};
};

}  // namespace probebox::latch
