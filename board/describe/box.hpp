#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "protocol/units/time.hpp"

// box.toml: the hardware of the box, as its vendor built it. Lines are named here and nowhere else.
namespace probebox::board {

// A line by its offset on the chip, or by the name that the kernel knows it by.
using LineAddress = std::variant<unsigned, std::string>;

enum class ActiveLevel : std::uint8_t { high, low };

// One digital line of the box: an input, but for the output of the loop-back.
struct GpioLine {
  std::string name;  // for messages to a person: "sync", "trigger 1"
  std::string chip;  // "gpiochip0", a label, or a path such as "/dev/gpiochip0"
  LineAddress line{0U};
  ActiveLevel active{ActiveLevel::high};
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

// Sources of data: "sim" (the emulated machine) or "none"; a probe also "usb" or "usb:SERIAL".
struct Devices {
  std::string encoders;
  double encoder_rate_hz{};  // how often all axes are latched
  std::string probe;
  std::string drift{"none"};  // sensors of the ball screws
};

// USB identity; the serial number is that of the box. Vendors have numbers of their own: 1209:0001 is for tests
// (pid.codes).
struct UsbIdentity {
  std::uint16_t vendor_id{0x1209};
  std::uint16_t product_id{0x0001};
  std::string manufacturer{"probebox"};
  std::string product{"probebox"};
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
  UsbIdentity usb;
};

}  // namespace probebox::board
