#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "board/describe/gpio_line.hpp"

// [encoder.AXIS] of box.toml: how the box reads the encoder of one axis. What a count means is in machine.toml.
namespace probebox::board {

// Axes that may have an encoder, in this order. Linear axes first; the numbers are those of axisBit().
inline constexpr std::string_view kEncoderAxes = "XYZABC";
inline constexpr std::size_t kEncoderLetters = kEncoderAxes.size();
inline constexpr std::size_t kLinearEncoders = 3;
// Behind them the secondary axes (ISO 841): parallel to X, Y and Z, whose positions theirs are added to.
inline constexpr std::string_view kAllEncoderAxes = "XYZABCUVW";
inline constexpr std::string_view kSecondaryAxes = kAllEncoderAxes.substr(kEncoderLetters);

// When the kernel's counter is read: by a timer, or at one of its events, which the sync line causes.
enum class LatchedBy : std::uint8_t { polling, index, capture, change_of_state };
// Value that is read at that event: the count itself, or the value that the device captured.
enum class LatchedValue : std::uint8_t { count, capture };

// One Count of a counter device of the kernel (/dev/counterN).
struct CounterEncoder {
  std::string device{};  // "counter0", a path, or the name in /sys/bus/counter/devices/counterN/name
  std::uint8_t count{};  // countN of that device
  std::uint8_t bits{};   // width of the count, which then wraps; 0: it wraps after its ceiling
  LatchedBy latched_by{LatchedBy::polling};
  std::uint8_t latch_channel{};
  LatchedValue latched_value{LatchedValue::count};
  bool has_index{};  // the device reports index pulses
  std::uint8_t index_channel{};
};

// The signals A and B on two lines of one gpio chip.
struct QuadratureEncoder {
  GpioLine a;
  GpioLine b;
  double maximum_edge_rate_hz{};  // of both lines together; above it no counts are delivered
};

inline constexpr std::uint8_t kMostReceiverChannels = 8;

// An axis counter of the probe's receiver, on the sample counter of the deflections: rate_hz of probe.toml is its rate.
struct ReceiverEncoder {
  std::uint8_t channel{};
  bool has_index{};
};

// Positions that the controller sends.
struct ControlEncoder {
  double counter_rate_hz{};  // of the counter or time stamp that numbers them
};

struct EncoderDescription {
  std::variant<CounterEncoder, QuadratureEncoder, ReceiverEncoder, ControlEncoder> by;
  double rate_hz{};       // of its counts
  bool is_absolute{};     // its counts give the position after a restart, too
  std::uint32_t line{1};  // line of its `kind` in box.toml
};

// By axis, in the order of kEncoderAxes.
using Encoders = std::array<std::optional<EncoderDescription>, kEncoderLetters>;
using SecondaryEncoders = std::array<std::optional<EncoderDescription>, kLinearEncoders>;

// "counter", "quadrature", "receiver", "control"
std::string_view kindOf(const EncoderDescription& encoder);

// True when the encoder itself gives an event at its index mark.
bool tellsIndex(const EncoderDescription& encoder);

}  // namespace probebox::board
