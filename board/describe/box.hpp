#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "board/describe/keys.hpp"
#include "protocol/units/time.hpp"

// Describes the hardware of the box as its vendor built it (box.toml). Lines are named only here.
namespace probebox::board {

// A line by its offset on the chip, or by its name in the kernel.
using LineAddress = std::variant<unsigned, std::string>;

enum class ActiveLevel : std::uint8_t { high, low };

// One digital line of the box: an input, except for the output of the loop-back.
struct GpioLine {
  std::string name;  // for messages to a person: "sync", "trigger 1"
  std::string chip;  // "gpiochip0", a label, or a path such as "/dev/gpiochip0"
  LineAddress line{0U};
  ActiveLevel active{ActiveLevel::high};
  std::optional<std::uint8_t> receiver{};  // its line of a receiver on USB, in place of one of a chip
  std::uint8_t receiver_number{};          // of which: 0 the first, 1 the second
};

// Names of the lines of a receiver (RECEIVER.md, version 3), by their numbers.
inline constexpr std::array<std::string_view, 4> kReceiverLineNames{"sync", "trigger-1", "trigger-2", "inhibit"};

inline constexpr std::size_t kReceivers = 2;  // of which axes and lines may be

// [encoder.AXIS] of box.toml: how the box reads the encoder of one axis. What a count means is in machine.toml.

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
// The second receiver's samples are mapped onto that counter.
struct ReceiverEncoder {
  std::uint8_t channel{};
  bool has_index{};
  std::uint8_t receiver_number{};  // 0 the first, 1 the second
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

// Sensors on devices of the kernel's industrial I/O (IIO), as box.toml names them. A value of the kernel's unit is
// (raw + offset) x scale of sysfs: mV, mA, m.

// Three channels of a converter that carry the probe's deflections. A trigger, such as the sync line, starts its
// frames.
struct ProbeAdc {
  std::string device;                   // the driver's name, a label, or "iio:device0"
  std::string trigger;                  // empty: the device keeps its present one
  std::array<std::string, 3> channels;  // "voltage0"
  std::array<double, 3> um_per_unit{};
  std::array<double, 3> zero_unit{};  // value without a deflection
};

// The sensor at the free end of a ball screw.
struct DriftSensor {
  std::uint8_t axis{};  // 0 X, 1 Y, 2 Z
  std::string device;
  std::string channel;
  double um_per_unit{};
  bool buffered{};     // read through the kernel's buffer, with its stamps
  double rate_hz{10};  // at which it is read; with a buffer: of its trigger
};

struct Sensors {
  std::optional<ProbeAdc> probe;
  std::vector<DriftSensor> drift;
};

// An index (reference mark) input belongs to one axis.
struct IndexLine {
  GpioLine line;
  std::uint8_t axis{};  // 0 X, 1 Y, 2 Z
};

// An output and an input joined by a wire. The box pulses the output and reads the input, because edges from elsewhere
// do not show how late this board stamps them.
struct LoopBack {
  GpioLine output;  // rests at the level that is not active
  GpioLine input;   // its active edge answers the output's
};

// Sources of data: "sim" (the emulated machine) or "none"; encoders also "axes" (each as `encoders_by_axis` says), a
// probe also "usb", "usb:SERIAL", "iio" (sensors.probe) or "trigger" (edges of a [[trigger]] alone), drift also "iio"
// (sensors.drift).
struct Devices {
  std::string encoders;
  double encoder_rate_hz{};  // rate at which axes are latched, unless one has a rate of its own
  std::string probe;
  std::string drift{"none"};  // sensors of the ball screws
  Encoders encoders_by_axis{};
  SecondaryEncoders secondary_encoders{};
};

// By its place in kAllEncoderAxes.
inline const std::optional<EncoderDescription>& encoderOf(const Devices& devices, std::size_t place) {
  return place < kEncoderLetters ? devices.encoders_by_axis.at(place)
                                 : devices.secondary_encoders.at(place - kEncoderLetters);
}

// What the front end of this project (docs/front-end.md) is told whenever it is connected; its sample rate is rate_hz
// of probe.toml.
struct FrontEnd {
  std::array<double, 3> full_scale_um{1000, 1000, 1000};
  std::optional<double> sync_out_hz;
  std::uint16_t samples_a_packet{10};

  static constexpr void keys(auto& self, auto&& key) {
    key("full_scale_um", self.full_scale_um, within(-100'000, 100'000).orUsual(),
        "of the channels a, b, c at full scale of the converter; negative: reversed");
    key("sync_out_hz", self.sync_out_hz, within(1, 100'000), "of the line SYNC_OUT; without it the line stays low");
    key("samples_a_packet", self.samples_a_packet, within(1, 32).orUsual(), "that go together over USB");
  }
};

// A second receiver on the sync line of the first, for more axes and lines. Its deflections are not read.
struct SecondReceiver {
  std::string serial_number;

  static constexpr void keys(auto& self, auto&& key) {
    key("serial_number", self.serial_number, kAnyText, "of its USB device, as `probebox status` shows it");
  }
};

// USB identity; the serial number is that of the box. Vendors have numbers of their own: 1209:0001 is for tests
// (pid.codes).
struct UsbIdentity {
  std::uint16_t vendor_id{0x1209};
  std::uint16_t product_id{0x0001};
  std::string manufacturer{"probebox"};
  std::string product{"probebox"};

  static constexpr void keys(auto& self, auto&& key) {
    key("vendor_id", self.vendor_id, within(1, 0xFFFF).orUsual(), "USB's number of the vendor");
    key("product_id", self.product_id, within(0, 0xFFFF).orUsual(), "the vendor's number of the product");
  }
};

struct Box {
  std::string board_name;
  std::string serial_number;
  GpioLine sync;                   // its active edge is the tick
  Nanoseconds sync_period{};       // nominal
  std::uint32_t samples_per_tick;  // 1 to 100
  std::vector<GpioLine> triggers;
  std::vector<IndexLine> indexes;
  std::vector<GpioLine> skips;
  std::vector<GpioLine> inhibits;  // active during a cut, when no result may come into force
  std::optional<LoopBack> loop_back;
  Devices devices;
  Sensors sensors;
  std::optional<FrontEnd> front_end;
  std::optional<SecondReceiver> second_receiver;
  UsbIdentity usb;
};

}  // namespace probebox::board
