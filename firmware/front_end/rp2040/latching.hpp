#pragma once
#include <cstdint>

#include "firmware/front_end/core/assembly.hpp"

namespace probebox::front_end {

// The state machines that count, stamp and pace, and the DMA that latches their counts at a sample or an index pulse
// without the processor.
class Latching {
 public:
  void start(const Settings& settings);
  void stop();

  // Tells `assembly` what was stamped.
  void tellChanges(Assembly& assembly);
  // Whether a sample was taken that has not been read.
  bool hasNext() const;
  // Reads it, without its deflection; `latched` is empty before.
  void next(Latched& latched);

 private:
  void tellLines(Assembly& assembly);
  void tellIndex(Assembly& assembly);
  void keepRunning();

  std::uint32_t samples_{}, lines_{}, indexes_{};  // places in the rings
};

}  // namespace probebox::front_end
