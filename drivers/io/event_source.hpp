#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "protocol/events/event.hpp"

namespace probebox::io {

// Where events come from: a gpio chip, a counter, a probe receiver, the emulated machine.
class EventSource {
 public:
  virtual ~EventSource() = default;

  // Moves what has arrived by `now` into `into`, in the order of the source, and says how many. Never blocks, never
  // allocates. What the source itself lost shows as sequence gaps or as SourceLost, never as silence.
  virtual std::size_t read(std::span<Event> into, MonoTime now) = 0;

  // A file descriptor that is readable when read() has something, or -1 for a source that must be asked.
  virtual int descriptor() const = 0;

  // For messages to a person: "gpiochip0 line 4 (sync)".
  virtual std::string_view name() const = 0;

  // Why nothing comes from it at present, with the remedy; empty when all is well. Changes in read() alone, and a
  // source that can come back does so there.
  virtual std::string_view problem() const { return {}; }

  // What came from the device and could not be made an event, such as a damaged packet. Changes in read() alone.
  virtual std::uint64_t unusable() const { return 0; }
};

}  // namespace probebox::io
