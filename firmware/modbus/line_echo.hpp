#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "firmware/modbus/rtu_requests.hpp"

namespace probebox::modbus {

// Removes echoes of the box's own answers from the received bytes. An RS-485 adapter whose receiver stays on while it
// sends receives them, and the answer to a write of one register equals the request: it would be answered again
// forever.
//
// An answer that cannot be a request (to a read, to a write of several registers, an exception) shows whether the line
// echoes:
//   it comes back                    the line echoes
//   a request comes in its place     it does not; a line that echoed is unknown first
//   nothing comes                    the same at the second time
//   something else comes             a damaged echo: a line that echoed is unknown
// While the line is unknown, a returning answer to a write of one register is passed on kMostRepeats times in a row,
// since a master may repeat a write, and then taken for an echo. Allocates nothing.
class LineEcho {
 public:
  static constexpr int kMostRepeats = 2;

  // Call with the answer that was just sent.
  void sent(std::span<const std::uint8_t> answer);

  // The bytes that are the master's: `held`, received before and first taken for an echo, then `rest`. Valid until the
  // next call.
  struct Passed {
    std::span<const std::byte> held;
    std::span<const std::byte> rest;
  };
  Passed strip(std::span<const std::byte> bytes);

  // Call when the line has been silent for longer than an echo takes.
  void silence();
  bool awaiting() const { return size_ > 0; }

  std::uint64_t removed() const { return removed_; }  // echoes

 private:
  enum class Line : std::uint8_t { unknown, echoes, does_not };
  static constexpr int kEnough = 2;  // answers that did not come back

  bool couldBeRequest() const;
  bool passes();
  void learn(Line line);
  void missed(int weight);
  void judge(std::span<const std::byte> bytes);

  std::array<std::byte, kMaxFrameBytes> answer_{};
  std::size_t size_{};     // 0: nothing is awaited
  std::size_t matched_{};  // bytes of it that have come back
  Line line_{Line::unknown};
  int repeats_{};
  int missed_{};
  // What came in the place of an echo, until it shows whether that is a request.
  std::array<std::uint8_t, kMaxFrameBytes> instead_{};
  std::size_t instead_size_{};
  bool judges_{};
  std::uint64_t removed_{};
};

}  // namespace probebox::modbus
