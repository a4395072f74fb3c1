#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "board/describe/box.hpp"
#include "protocol/units/outcome.hpp"
#include "protocol/units/time.hpp"

// Interface between a counter device, real or emulated, and the code that evaluates its counts.
namespace probebox::counter {

// What an event of a counter device means for one of its counts; foreign: of another count or reader.
enum class Happened : std::uint8_t { latched, index, foreign };

// One event, as the kernel queued it.
struct CounterEvent {
  Happened what{};
  std::uint64_t value{};  // the watched value: the count, or the captured value
  bool is_valid{true};    // the kernel could read it
  MonoTime at{};          // the kernel's stamp
};

// A count, and the times just before and after its read.
struct PolledCount {
  std::uint64_t value{};
  MonoTime before{};
  MonoTime after{};
};

// Properties of a count, read when its device is opened.
struct OpenedCount {
  std::optional<std::uint64_t> ceiling;  // the largest value before it wraps to 0, never 0; nullopt: not known
};

// One count of a counter device: real or emulated.
class CounterPort {
 public:
  virtual ~CounterPort() = default;

  // Finds and opens the device, and asks for its events. An error names device and remedy.
  virtual Outcome<OpenedCount> open() = 0;
  virtual void close() = 0;

  // Moves queued events into `into`, in their order, and returns their number; nothing when the device is gone.
  virtual std::optional<std::size_t> readEvents(std::span<CounterEvent> into) = 0;
  // Reads the count now; nothing when the device is gone.
  virtual std::optional<PolledCount> poll() = 0;
  // True once in every interval of polling, when a read is due; a port without a timer decides by `now`.
  virtual bool isDue(MonoTime now) = 0;

  // Readable when there are events or it is time to poll; -1 when it is not open.
  virtual int descriptor() const = 0;
};

}  // namespace probebox::counter
