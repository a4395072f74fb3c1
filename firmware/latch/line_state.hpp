#pragma once
#include <cstdint>

#include "firmware/latch/trace.hpp"
#include "protocol/events/event.hpp"

namespace probebox::latch {

// What the lines and markers say at a sample's time, as bits of Channel::flags. Changes wait here until a sample passes
// them.
class LineState {
 public:
  enum class Pushed : std::uint8_t { taken, late, overwrote };

  Pushed push(const Edge& edge);
  Pushed push(const Marker& marker);

  // Takes in everything up to and at `t`; times that go back are harmless.
  void passTo(MonoTime t);

  // The bits now. What is said "since the previous record" is said once.
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
  std::uint32_t touching_{};  // a bit per trigger line
  std::uint32_t skipping_{};
  bool step_{};
  std::int64_t since_record_{};
};

}  // namespace probebox::latch
