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

// One pulse of the output and the kernel's stamp of the input, all on CLOCK_MONOTONIC.
struct LoopBackPulse {
  MonoTime before{};              // just before the write that makes the edge
  MonoTime after{};               // just after it: the edge was in between
  std::optional<MonoTime> stamp;  // nullopt for an edge that did not arrive in time
};

// Pulses an output of the box that is wired to one of its inputs. stampLateness() evaluates late and missing edges.
class LoopBack {
 public:
  virtual ~LoopBack() = default;

  // Makes up to this many pulses, for at most three seconds, and returns the outcome of each. Stops early when no edges
  // arrive. An error names the unavailable chip or line and the remedy.
  virtual Outcome<std::vector<LoopBackPulse>> measure(std::size_t pulses) = 0;
};

// Uses the lines of a real board, requested only while measuring. Lines and chips may have several names: a line that
// the box watches (`watched`) is never driven under any name, nor is the input.
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
