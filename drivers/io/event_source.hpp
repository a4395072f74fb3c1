#pragma once
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "protocol/events/event.hpp"

namespace probebox::io {

// A fault that a device can tell of itself.
struct SourceFault {
  std::string_view name;
  std::string_view meaning;
};

// Delivers events from a device: a gpio chip, a counter, a probe receiver, the emulated machine.
class EventSource {
 public:
  virtual ~EventSource() = default;

  // Moves the events that arrived by `now` into `into`, in their order, and returns their number. Never blocks or
  // allocates. Losses of the source appear as sequence gaps or SourceLost.
  virtual std::size_t read(std::span<Event> into, MonoTime now) = 0;

  // File descriptor that is readable when read() has events, or -1 for a source that must be polled.
  virtual int descriptor() const = 0;

  // For messages: "gpiochip0 line 4 (sync)".
  virtual std::string_view name() const = 0;

  // Why the source delivers nothing at present, with the remedy; empty if there is no problem. Changes in read() only,
  // which also reopens a lost source.
  virtual std::string_view problem() const { return {}; }

  // What the device says is wrong with it while it delivers, now or in the last minute: bit k is faultNames()[k].
  // Changes in read() only.
  virtual std::uint32_t faults() const { return 0; }
  virtual std::span<const SourceFault> faultNames() const { return {}; }

  // Number of inputs that could not become events, such as damaged packets. Changes in read() only.
  virtual std::uint64_t unusable() const { return 0; }
};

}  // namespace probebox::io
