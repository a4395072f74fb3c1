#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/modbus/rtu_requests.hpp"

namespace probebox::modbus {

// Removes the box's own answers from what a line delivers. An RS-485 adapter whose receiver stays on while it sends
// hears them, and the answer to a write of one register is that request byte for byte: it would be answered again for
// ever.
//
// An answer that cannot be a request (of a read, of a write of several registers, an exception) shows whether the line
// echoes. Until the first of these, an answer to a write of one register that comes back is passed on kMostRepeats
// times in a row, as a master may repeat a write, and then taken for an echo. Allocates nothing.
class LineEcho {
 public:
  static constexpr int kMostRepeats = 2;

  // The answer that was just sent.
  void sent(std::span<const std::uint8_t> answer);

  // What of the bytes that came is the master's: `held`, which had come before and looked like an echo, then `rest`.
  // Both are valid until the next call.
  struct Passed {
    std::span<const std::byte> held;
    std::span<const std::byte> rest;
  };
  Passed strip(std::span<const std::byte> bytes);

  // The line has been silent for longer than an echo takes.
  void silence();
  bool awaiting() const { return size_ > 0; }

  std::uint64_t removed() const { return removed_; }  // echoes

 private:
  enum class Line : std::uint8_t { unknown, echoes, does_not };

  bool couldBeRequest() const;
  bool passes();
  void learn(Line line);

  std::array<std::byte, kMaxFrameBytes> answer_{};
  std::size_t size_{};     // 0: nothing is awaited
  std::size_t matched_{};  // bytes of it that have come back
  Line line_{Line::unknown};
  int repeats_{};
  std::uint64_t removed_{};
};

}  // namespace probebox::modbus
