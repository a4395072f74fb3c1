#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/messages/fields.hpp"
#include "protocol/messages/types.hpp"

// HELLO -> WELCOME, DESCRIPTOR, TEST_PATTERN -> START.
namespace probebox::messages {

inline constexpr std::array<std::uint8_t, 4> kMagic{'P', 'B', 'X', '1'};

// The time of day, as a host knows it.
struct TimeOfDay {
  static constexpr std::uint32_t kErrorUnknown = ~std::uint32_t{0};
  std::int64_t utc_us{};
  std::uint32_t error_ms{kErrorUnknown};
  static constexpr void fields(auto& self, auto&& field) {
    field("utc_us", self.utc_us,
          "us since 1970-01-01T00:00:00 UTC when this was sent; 0: nothing keeps the host's clock right");
    field("error_ms", self.error_ms,
          "ms, the most that it may be off; all ones: the host's clock was set from a hardware clock, and its error is "
          "not known");
  }
};

// Opens a session, host to box. No host sends the defaults, so an empty payload is not a valid HELLO.
struct Hello {
  static constexpr MessageType kType = MessageType::hello;
  std::array<std::uint8_t, 4> magic{};
  std::uint8_t major{};
  std::uint16_t min_minor{};
  std::uint16_t max_minor{};
  BootId boot_id{};
  TimeOfDay time_of_day{};
  static constexpr void fields(auto& self, auto&& field) {
    field("magic", self.magic, "the four letters PBX1");
    field("major", self.major, "protocol major that the host speaks; must be the box's");
    field("min_minor", self.min_minor, "oldest minor that the host accepts");
    field("max_minor", self.max_minor, "newest minor that the host knows");
    field("boot_id", self.boot_id,
          "the box's boot id that the host saw last, zeros for none: only then resume is meant");
    field("time_of_day", self.time_of_day,
          "for a box without a clock of its own; taken from hosts that may accept results");
  }
  // Returns the HELLO of a host of this build.
  static constexpr Hello current(const BootId& last_seen = {}, const TimeOfDay& time_of_day = {}) {
    return {kMagic, kProtocolMajor, 0, kProtocolMinor, last_seen, time_of_day};
  }
};

// Answers HELLO, box to host.
template <class TextType>
struct BasicWelcome {
  static constexpr MessageType kType = MessageType::welcome;
  std::uint8_t major{kProtocolMajor};
  std::uint16_t minor{kProtocolMinor};
  std::uint32_t session_id{};
  TextType firmware_version{};
  BootId boot_id{};
  static constexpr void fields(auto& self, auto&& field) {
    field("major", self.major, "protocol major of the box");
    field("minor", self.minor, "the minor that both speak from here on");
    field("session_id", self.session_id, "+1 every handshake of this box since its boot");
    field("firmware_version", self.firmware_version, "as probeboxd --version prints it");
    field("boot_id", self.boot_id, "changes when the box restarts: sample indices then begin anew");
  }
};
using Welcome = BasicWelcome<std::string>;
using WelcomeView = BasicWelcome<std::string_view>;

struct ChannelDescription {
  std::string name{};
  std::string unit{};
  double scale{1.0};
  std::uint8_t bytes{4};
  bool is_signed{true};
  std::string doc{};
  static constexpr void fields(auto& self, auto&& field) {
    field("name", self.name, "such as deflection_a");
    field("unit", self.unit, "of value times scale, such as nm; empty for a bare number");
    field("scale", self.scale, "unit per count");
    field("bytes", self.bytes, "1, 2, 4 or 8: width of one value in profile raw");
    field("is_signed", self.is_signed, "1 for two's complement");
    field("doc", self.doc, "one sentence for a person");
  }
};

// The system delay that the box corrects for (tau = t_machine - t_probe).
struct DelayInForce {
  bool calibrated{};
  std::array<double, 3> tau_s{};
  std::array<double, 3> sd_s{};
  std::uint64_t result_id{};
  static constexpr void fields(auto& self, auto&& field) {
    field("calibrated", self.calibrated, "0 when no result is active; the others are then 0");
    field("tau_s", self.tau_s, "s, X Y Z, machine minus probe");
    field("sd_s", self.sd_s, "s, X Y Z, combined standard uncertainty (k = 1)");
    field("result_id", self.result_id, "the result that is in force");
  }
};

// Factors and offsets that turn samples into positions of the stylus tip: machine position = counts * scale +
// offset_mm, tool position = machine position - (screw_mm + screw_slope * machine position), tip = tool position + gain
// * deflection.
struct TipDescription {
  bool has_deflection{};
  bool turned{};
  std::uint8_t referenced{};
  std::uint8_t screws_unknown{};
  std::array<double, 3> offset_mm{};
  std::array<double, 3> screw_mm{};
  std::array<double, 3> screw_slope{};
  std::uint8_t screws{};
  double ball_radius_mm{};
  double noise_nm{};
  std::uint64_t gain_result_id{};
  std::array<std::array<double, 3>, 3> gain_sd{};
  static constexpr void fields(auto& self, auto&& field) {
    field(
        "has_deflection", self.has_deflection,
        "0 where the channels are no deflections of the stylus: of a touch-trigger probe, or while a sensor head is in "
        "the spindle");
    field("turned", self.turned,
          "1 while spindle A or the swivelling head is known not to stand at zero: the gain belongs to the probe at "
          "zero");
    field("referenced", self.referenced, "axes whose machine position is known: bit 0 X, 1 Y, 2 Z");
    field("screws_unknown", self.screws_unknown,
          "axes with a sensor on their screw that delivers no readings, a bit each");
    field("offset_mm", self.offset_mm, "mm, X Y Z, machine position at count 0");
    field("screw_mm", self.screw_mm,
          "mm, X Y Z, what the warm screw adds at machine position 0; told again when it has changed by 0.2 um, but no "
          "more often than every 5 s");
    field("screw_slope", self.screw_slope, "mm per mm, its change over the axis");
    field("screws", self.screws, "axes with a sensor on their screw, a bit each");
    field("ball_radius_mm", self.ball_radius_mm, "mm, of the stylus' ball; 0 for none");
    field("noise_nm", self.noise_nm,
          "nm, standard deviation (k = 1) of one sample of one channel, as probe.toml states");
    field("gain_result_id", self.gain_result_id,
          "the result that measured the gain: it is in force; 0: the gain of probe.toml, whose uncertainty is unknown");
    field("gain_sd", self.gain_sd, "row by row, standard deviation (k = 1) of the gain; zeros without a result");
  }
};

// Profile tight is encoded for each host as its blocks are sent, microseconds a sample: no box sends it at more than
// this.
inline constexpr double kMostTight_Hz = 50'000;

// Describes the channels, box to host: after WELCOME, and again before the first block that another descriptor encodes
// (a delay or a reference came into force, or a resumed stream returns to earlier blocks). Frames carry the CRC-32C of
// their descriptor as its hash: decode a block with the descriptor whose hash its frame carries.
struct Descriptor {
  static constexpr MessageType kType = MessageType::descriptor;
  std::string board{};
  std::string serial_number{};
  std::string firmware_version{};
  std::string machine{};
  std::string probe{};
  std::int64_t nominal_tick_period_ns{1'000'000};
  std::uint16_t samples_per_tick{1};
  std::vector<ChannelDescription> channels{};
  std::array<std::array<double, 3>, 3> gain{};
  DelayInForce delay{};
  TipDescription tip{};
  double samplesPerSecond() const {
    return nominal_tick_period_ns > 0 ? 1e9 * samples_per_tick / static_cast<double>(nominal_tick_period_ns) : 0;
  }
  static constexpr void fields(auto& self, auto&& field) {
    field("board", self.board, "name of the board description");
    field("serial_number", self.serial_number, "of the box");
    field("firmware_version", self.firmware_version, "as probeboxd --version prints it");
    field("machine", self.machine, "name of the machine description");
    field("probe", self.probe, "name and serial number of the probe");
    field("nominal_tick_period_ns", self.nominal_tick_period_ns, "ns, nominal period of the master clock");
    field("samples_per_tick", self.samples_per_tick, "1 to 100");
    field("channels", self.channels, "in the order of the columns of SAMPLES");
    field("gain", self.gain,
          "row by row, nm of tip travel in machine axes X Y Z per nm of channel a b c: that of the delay's result in "
          "force, or of probe.toml");
    field("delay", self.delay, "the system delay in force when this was sent");
    field("tip", self.tip, "from samples to the tip");
  }
};

// Tests the link, box to host: every byte value once, in the order below. A link that drops or changes a byte value is
// detected.
struct TestPattern {
  static constexpr MessageType kType = MessageType::test_pattern;
  std::array<std::uint8_t, 256> bytes{};
  static constexpr void fields(auto& self, auto&& field) {
    field("bytes", self.bytes, "byte k is (167 k + 13) mod 256: every value once, neighbours far apart");
  }
  // Returns the pattern that a good link delivers.
  static constexpr TestPattern expected() {
    TestPattern pattern;
    for (std::size_t k = 0; k < pattern.bytes.size(); ++k)
      pattern.bytes[k] = static_cast<std::uint8_t>((167 * k + 13) & 0xFFU);
    return pattern;
  }
};

inline constexpr std::uint64_t kUnlimitedCredit = ~std::uint64_t{0};

// Starts the stream of samples, host to box.
struct Start {
  static constexpr MessageType kType = MessageType::start;
  std::uint8_t stream{1};
  Profile profile{};
  Policy policy{};
  std::uint64_t credit_bytes{kUnlimitedCredit};
  bool has_resume{};
  SampleIndex resume_from{};
  bool triggers{};
  std::uint32_t triggers_from{};
  static constexpr void fields(auto& self, auto&& field) {
    field("stream", self.stream, "stream id, 1 for the samples");
    field("profile", self.profile, "0 raw, 1 fast, 2 tight");
    field("policy", self.policy, "when the host is too slow: 0 live (drop the oldest), 1 record (drop the newest)");
    field("credit_bytes", self.credit_bytes,
          "bytes of SAMPLES, SHORT_SAMPLES and GAP frames that may be sent at once; all ones for no limit");
    field("has_resume", self.has_resume, "1 when resume_from counts");
    field("resume_from", self.resume_from, "the first sample that the host does not have");
    field("triggers", self.triggers, "1 when TRIGGER frames are wanted");
    field("triggers_from", self.triggers_from,
          "number of the first trigger that the host does not have, of the same boot; 0 for the next one that comes");
  }
  friend bool operator==(const Start&, const Start&) = default;
};

// Stops the stream, host to box. The answer is a HEARTBEAT with streaming 0.
struct Stop {
  static constexpr MessageType kType = MessageType::stop;
  std::uint8_t stream{1};
  static constexpr void fields(auto& self, auto&& field) { field("stream", self.stream, "stream id"); }
};

// Grants credit, host to box. It is a total, not an increment, so the next CREDIT makes up for a lost one.
struct Credit {
  static constexpr MessageType kType = MessageType::credit;
  std::uint64_t total_bytes{};
  static constexpr void fields(auto& self, auto&& field) {
    field("total_bytes", self.total_bytes,
          "bytes of SAMPLES, SHORT_SAMPLES and GAP frames granted since START; lower than before is ignored");
  }
};

// Refuses a frame that was understood, box to host. Answers to REQUEST carry their own code instead.
template <class TextType>
struct BasicRefusal {
  static constexpr MessageType kType = MessageType::refusal;
  ErrorCode code{};
  MessageType about{};
  TextType text{};
  static constexpr void fields(auto& self, auto&& field) {
    field("code", self.code, "named error");
    field("about", self.about, "type of the message that was refused");
    field("text", self.text, "what and what to do, for a person");
  }
};
using Refusal = BasicRefusal<std::string>;
using RefusalView = BasicRefusal<std::string_view>;

}  // namespace probebox::messages
