#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "board/describe/encoder.hpp"
#include "board/describe/gpio_line.hpp"
#include "board/describe/keys.hpp"
#include "board/describe/sensors.hpp"
#include "protocol/units/time.hpp"

// Describes the hardware of the box as its vendor built it (box.toml). Lines are named only here.
namespace probebox::board {

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
  UsbIdentity usb;
};

}  // namespace probebox::board
