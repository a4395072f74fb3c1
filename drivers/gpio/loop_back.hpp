#pragma once
#include <cstddef>
#include <optional>
#include <utility>
#include <vector>

#include "board/describe/box.hpp"
#include "drivers/gpio/lines.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/time.hpp"

namespace probebox::gpio {

// One pulse of the output, and what the kernel said of the input: all on CLOCK_MONOTONIC.
struct LoopBackPulse {
  MonoTime before{};              // just before the write that makes the edge
  MonoTime after{};               // just after it: the edge was in between
  std::optional<MonoTime> stamp;  // nothing for an edge that did not come in time
};

// An output of the box that is joined to an input of the same box. What came late or never is for stampLateness().
class LoopBack {
 public:
  virtual ~LoopBack() = default;

  // Makes up to so many pulses and says what came of each. Takes its time, three seconds at the most: fewer pulses when
  // they are over, or when nothing comes any more. An error names the chip or line that cannot be had, and the remedy.
  virtual Outcome<std::vector<LoopBackPulse>> measure(std::size_t pulses) = 0;
};

// The lines of a real board, held only while measuring. A line has several names, and chips have as well: what the box
// watches (`watched`) is never driven, whatever it is called, and neither is the input.
class LinuxLoopBack final : public LoopBack {
 public:
  LinuxLoopBack(board::LoopBack lines, std::vector<ChipLines> watched)
      : lines_{std::move(lines)}, watched_{std::move(watched)} {}
  Outcome<std::vector<LoopBackPulse>> measure(std::size_t pulses) override;

 private:
  std::optional<Error> whyShared() const;

  board::LoopBack lines_;
  std::vector<ChipLines> watched_;
};

}  // namespace probebox::gpio
