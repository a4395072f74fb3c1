#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "protocol/receiver/packet.hpp"

// What the front end (firmware/front_end, an RP2040) is asked on its control endpoint, and its pins. Requests are of
// type vendor, recipient device; their data are these structures as in the packets: little endian, without padding.
namespace probebox::front_end {

inline constexpr std::uint16_t kVersion = 0x0100;  // bcdDevice too: major, minor
inline constexpr std::size_t kCounters = 4;
inline constexpr std::uint32_t kSystemHz = 125'000'000;
inline constexpr std::uint32_t kCyclesAStep = 6;  // of the counter that stamps everything: 48 ns

enum class Request : std::uint8_t {
  identity = 1,  // IN: Identity
  pins = 2,      // IN: one byte a pin, the gpio of each line of kPins
  counters = 3,  // IN: FrontEndCounters
  settings = 4,  // IN: Settings in use; OUT: new ones. They are checked; stalled when refused, with a code in counters
  boot_loader = 5,  // OUT, wValue kBootLoaderKey: restarts into the boot loader of the chip, for an update
};
inline constexpr std::uint16_t kBootLoaderKey = 0xB007;

struct Identity {
  std::uint16_t version{kVersion};
  std::uint8_t packet_version{usb_probe::PacketHeader::kWithEdges};
  std::uint8_t counters{kCounters};
  std::uint8_t lines{usb_probe::kReceiverLines};
  std::uint32_t step_ps{1'000'000 / (kSystemHz / 1'000'000) * kCyclesAStep};
  static constexpr void fields(auto& self, auto&& field) {
    field("version", self.version, "of the program: major in the high byte, minor in the low one");
    field("packet_version", self.packet_version, "of its packets");
    field("counters", self.counters, "axis counters");
    field("lines", self.lines, "lines whose edges it stamps");
    field("step_ps", self.step_ps, "ps, a step of its counter");
  }
};

struct Settings {
  std::uint32_t steps_a_sample{10'422};  // 1998.98 Hz: no divisor of USB's frames (RECEIVER.md, Rules)
  std::uint16_t samples_a_packet{10};
  std::uint32_t sync_out_steps{20'833};  // 1 kHz
  std::array<std::int32_t, 3> full_scale_nm{1'000'000, 1'000'000, 1'000'000};
  static constexpr void fields(auto& self, auto&& field) {
    field("steps_a_sample", self.steps_a_sample, "steps of the counter in a sample period");
    field("samples_a_packet", self.samples_a_packet, "samples in a packet, 1 to 32");
    field("sync_out_steps", self.sync_out_steps, "steps in a period of the sync output; 0: it stays low");
    field("full_scale_nm", self.full_scale_nm,
          "nm at full scale of the converter, channels a, b, c; negative: reversed");
  }
  friend constexpr bool operator==(const Settings&, const Settings&) = default;
};
inline constexpr std::size_t kSettingsBytes = 22;
inline constexpr std::uint32_t kLeastSteps = 2'084;  // 10 kHz: the longest path of the program fits between two samples
inline constexpr std::uint32_t kMostSteps = 208'333;  // 100 Hz
inline constexpr std::uint16_t kMostSamplesAPacket = 32;
inline constexpr std::uint32_t kMostSyncOutSteps = 20'833'333;  // 1 Hz
inline constexpr std::uint32_t kLeastSyncOutSteps = 208;        // 100 kHz

// What an image of the program is told by: it stands behind the vectors, at a fixed place of the flash.
struct ImageMark {
  static constexpr std::array<char, 12> kName{'p', 'r', 'o', 'b', 'e', 'b', 'o', 'x', '-', 'f', 'e', '\0'};
  std::array<char, 12> name{kName};
  std::uint16_t version{kVersion};
  std::uint16_t packet_version{usb_probe::PacketHeader::kWithEdges};
};
inline constexpr std::size_t kBoot2Bytes = 256;  // with its checksum in the last four
inline constexpr std::size_t kImageMarkAt = kBoot2Bytes + 48 * 4;

enum class RefusalCode : std::uint8_t {
  none = 0,
  bad_size = 1,
  bad_steps_a_sample = 2,
  bad_samples_a_packet = 3,
  bad_sync_out_steps = 4,
  bad_full_scale = 5,
};

// Since the start of the program.
struct FrontEndCounters {
  std::uint32_t samples{};
  std::uint32_t samples_dropped{};
  std::uint32_t edges_lost{};
  std::uint32_t latches_lost{};
  std::uint32_t converter_silent{};
  std::uint32_t deflections_late{};
  std::array<std::uint32_t, kCounters> illegal_transitions{};
  std::array<std::uint32_t, kCounters> overruns{};
  std::uint32_t most_pass_us{};
  std::uint8_t last_refusal{};
  static constexpr void fields(auto& self, auto&& field) {
    field("samples", self.samples, "samples taken");
    field("samples_dropped", self.samples_dropped, "samples not sent because nobody read");
    field("edges_lost", self.edges_lost, "edges of lines that did not fit");
    field("latches_lost", self.latches_lost, "index pulses that did not fit");
    field("converter_silent", self.converter_silent, "samples without an answer of the converter");
    field("deflections_late", self.deflections_late, "samples whose deflection was not read before the next one");
    field("illegal_transitions", self.illegal_transitions, "samples in which A and B of a counter changed at once");
    field("overruns", self.overruns, "samples in which a counter moved faster than it holds");
    field("most_pass_us", self.most_pass_us, "us, longest pass of the program's loop");
    field("last_refusal", self.last_refusal,
          "of settings: 0 none, 1 size, 2 steps_a_sample, 3 samples_a_packet, 4 sync_out_steps, 5 full_scale_nm");
  }
};

// Every pin that the program uses, by what it is for. The order is that of the answer to Request::pins.
enum class PinUse : std::uint8_t { input, output };
struct Pin {
  std::uint8_t gpio;
  PinUse use;
  std::string_view name;
  std::string_view meaning;
};
inline constexpr std::uint8_t kFirstEncoderPin = 0;  // A and B of counter k: 2 k, 2 k + 1
inline constexpr std::uint8_t kFirstIndexPin = 8;    // of counter k: 8 + k; the pin of wires 0 follows
inline constexpr std::uint8_t kFirstLinePin = 13;    // in the order of ReceiverLine
inline constexpr std::uint8_t kClockPin = 18, kBusyPin = 19, kDataPin = 20, kSelectPin = 21;
inline constexpr std::uint8_t kSyncOutPin = 22, kLedPin = 25, kConvertPin = 26;
inline constexpr std::array<std::uint8_t, kCounters> kWirePins{12, 27, 28, 23};

inline constexpr std::array<Pin, 28> kPins{{
    {0, PinUse::input, "A0", "encoder of counter 0, A"},
    {1, PinUse::input, "B0", "encoder of counter 0, B"},
    {2, PinUse::input, "A1", "encoder of counter 1, A"},
    {3, PinUse::input, "B1", "encoder of counter 1, B"},
    {4, PinUse::input, "A2", "encoder of counter 2, A"},
    {5, PinUse::input, "B2", "encoder of counter 2, B"},
    {6, PinUse::input, "A3", "encoder of counter 3, A"},
    {7, PinUse::input, "B3", "encoder of counter 3, B"},
    {8, PinUse::input, "Z0", "index of counter 0, active high"},
    {9, PinUse::input, "Z1", "index of counter 1, active high"},
    {10, PinUse::input, "Z2", "index of counter 2, active high"},
    {11, PinUse::input, "Z3", "index of counter 3, active high"},
    {kWirePins[0], PinUse::input, "WIRES0", "high while the line receiver of counter 0 finds a broken wire"},
    {13, PinUse::input, "SYNC", "sync line of the master clock"},
    {14, PinUse::input, "TRIGGER1", "first trigger"},
    {15, PinUse::input, "TRIGGER2", "second trigger"},
    {16, PinUse::input, "INHIBIT", "inhibit: a cut is on"},
    {17, PinUse::input, "LOOPBACK", "wired to SYNC_OUT for a factory test"},
    {kClockPin, PinUse::output, "SCLK", "converter: serial clock"},
    {kBusyPin, PinUse::input, "BUSY", "converter: high while it converts"},
    {kDataPin, PinUse::input, "DOUTA", "converter: serial data, channels a, b, c"},
    {kSelectPin, PinUse::output, "CS", "converter: chip select, active low"},
    {kSyncOutPin, PinUse::output, "SYNC_OUT", "master clock for a control that takes one"},
    {kWirePins[3], PinUse::input, "WIRES3",
     "as WIRES0, of counter 3; not on the headers of a Pico, where it stays low"},
    {kLedPin, PinUse::output, "LED", "on while samples are read"},
    {kConvertPin, PinUse::output, "CONVST", "converter: a rising edge starts the conversion of all channels"},
    {kWirePins[1], PinUse::input, "WIRES1", "as WIRES0, of counter 1"},
    {kWirePins[2], PinUse::input, "WIRES2", "as WIRES0, of counter 2"},
}};

}  // namespace probebox::front_end
