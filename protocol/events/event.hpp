#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <type_traits>
#include <variant>

#include "protocol/events/activation.hpp"
#include "protocol/events/axes.hpp"
#include "protocol/events/procedure.hpp"
#include "protocol/units/correction_sources.hpp"
#include "protocol/units/quantity.hpp"
#include "protocol/units/time.hpp"

// Defines every input of the core as an event: a plain, trivially copyable value with its own stamp. The core is a
// function of the event sequence, so a journal of events replays to the same bytes. Each event lists its fields once,
// for the journal's encoder and decoder and for the reference page. Requests of people and programs are events too, so
// a journal contains every cause.
namespace probebox {

// Events that another device has numbered on its own counter. firmware/clock assigns their time.

// Receivers on USB that a box reads: the first has the probe, the second axes and lines alone.
inline constexpr std::size_t kReceivers = 2;

// One sample of a probe receiver that counts samples on its own oscillator. firmware/clock assigns its time.
struct CountedDeflection {
  std::uint8_t run{};
  std::uint32_t counter{};
  std::array<std::int32_t, 3> channels_nm{};
  bool clipped{};
  bool newest{};
  MonoTime at{};
  std::uint8_t receiver{};
  static constexpr void fields(auto& self, auto&& field) {
    field("run", self.run, "another value than before: the counter began anew");
    field("counter", self.counter, "the receiver's own sample counter, wraps; a gap means samples were lost");
    field("channels_nm", self.channels_nm, "nm at unit gain, channels a, b, c");
    field("clipped", self.clipped, "1 when a channel is at the end of its range");
    field("newest", self.newest,
          "1 when it was the last sample taken before `at`: only then `at` tells about its time");
    field("at", self.at, "ns, monotonic, of this boot: when the sample arrived, which is later than it was taken");
    field("receiver", self.receiver, "which receiver: 0 the first, 1 the second");
  }
};

// The counts of axes that a receiver read with one of its samples. firmware/clock assigns the time of that sample.
struct CountedAxes {
  std::uint8_t run{};
  std::uint32_t counter{};
  std::uint8_t axes{};
  std::array<std::int64_t, kLinearAxes + kRotaryAxes> counts{};
  std::uint8_t faults{};
  MonoTime at{};
  std::uint8_t receiver{};
  static constexpr void fields(auto& self, auto&& field) {
    field("run", self.run, "another value than before: the receiver began anew, and its counts do not go on");
    field("counter", self.counter, "the receiver's sample counter: that of the deflection before");
    field("axes", self.axes, "whose counts there are: bit 0 X, 1 Y, 2 Z, 3 A, 4 B, 5 C");
    field("counts", self.counts, "encoder counts, X Y Z A B C; their size is in machine.toml");
    field("faults", self.faults, "axes, as above, whose counter has lost counts since the last sample that was sent");
    field("at", self.at, "ns, monotonic, of this boot: when the sample arrived, which is later than it was taken");
    field("receiver", self.receiver, "which receiver: 0 the first, 1 the second");
  }
};

// The pulse of an index mark that a receiver latched on its sample counter.
struct CountedIndex {
  std::uint8_t run{};
  std::uint32_t counter{};
  std::uint32_t fraction{};
  std::uint8_t axis{};
  std::int64_t counts{};
  MonoTime at{};
  std::uint8_t receiver{};
  static constexpr void fields(auto& self, auto&& field) {
    field("run", self.run, "that of the sample before the pulse");
    field("counter", self.counter, "the receiver's sample counter: the last sample before the pulse");
    field("fraction", self.fraction, "from that sample to the pulse, in 2^-32 of a sample period");
    field("axis", self.axis, "0 X, 1 Y, 2 Z, 3 A, 4 B, 5 C");
    field("counts", self.counts, "encoder counts at the pulse");
    field("at", self.at, "ns, monotonic, of this boot: when the packet arrived");
    field("receiver", self.receiver, "which receiver: 0 the first, 1 the second");
  }
};

// Positions of axes that the controller knows, numbered on its own counter. firmware/clock assigns their time.
struct ControlPositions {
  std::uint8_t run{};
  std::uint32_t counter{};
  std::uint8_t axes{};
  std::array<std::int64_t, kLinearAxes + kRotaryAxes> counts{};
  bool newest{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("run", self.run, "another value than before: the counter began anew, and incremental counts do not go on");
    field("counter", self.counter, "the controller's own counter or time stamp when it had these positions; wraps");
    field("axes", self.axes, "whose positions there are: bit 0 X, 1 Y, 2 Z, 3 A, 4 B, 5 C");
    field("counts", self.counts, "positions as counts, X Y Z A B C; their size is in machine.toml");
    field("newest", self.newest, "1 for the last of a message: only then `at` tells about its time");
    field("at", self.at, "ns, monotonic, of this boot: when they arrived, which is later than they were valid");
  }
};

// Purpose of an input of the box. box.toml maps roles to lines of gpio chips.
enum class LineRole : std::uint8_t { sync = 0, trigger = 1, index = 2, skip = 3, inhibit = 4 };
enum class Level : std::uint8_t { inactive = 0, active = 1 };

// One edge of a digital line, stamped by the kernel.
struct Edge {
  LineRole role{};
  std::uint8_t line{};
  Level level{};
  std::uint32_t line_sequence{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("role", self.role, "0 sync, 1 trigger, 2 index, 3 skip, 4 inhibit");
    field("line", self.line, "which line of that role, from 0");
    field("level", self.level, "0 inactive, 1 active, after polarity: the level that the edge leads to");
    field("line_sequence", self.line_sequence, "the kernel's count of this line's edges; a gap means edges were lost");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

// One edge of a digital line that a receiver stamped on its sample counter. firmware/clock assigns its time.
struct CountedEdge {
  std::uint8_t run{};
  std::uint32_t counter{};
  std::uint32_t fraction{};
  LineRole role{};
  std::uint8_t line{};
  Level level{};
  std::uint32_t line_sequence{};
  MonoTime at{};
  std::uint8_t receiver{};
  static constexpr void fields(auto& self, auto&& field) {
    field("run", self.run, "that of the sample before the edge");
    field("counter", self.counter, "the receiver's sample counter: the last sample before the edge");
    field("fraction", self.fraction, "from that sample to the edge, in 2^-32 of a sample period");
    field("role", self.role, "0 sync, 1 trigger, 2 index, 3 skip, 4 inhibit");
    field("line", self.line, "which line of that role, from 0");
    field("level", self.level, "0 inactive, 1 active, after polarity: the level that the edge leads to");
    field("line_sequence", self.line_sequence,
          "the receiver's count of this line's edges; a gap means edges were lost");
    field("at", self.at, "ns, monotonic, of this boot: when the packet arrived");
    field("receiver", self.receiver, "which receiver: 0 the first, 1 the second");
  }
};

// The encoder counts of one axis, latched by its counter.
struct Count {
  Axis axis{};
  std::uint32_t sequence{};
  std::int64_t counts{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("axis", self.axis, "0 X, 1 Y, 2 Z");
    field("sequence", self.sequence, "counts every latch of this axis; a gap means latches were lost");
    field("counts", self.counts, "encoder counts; their size is in machine.toml");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

// One sample of the probe's channels a, b, c, before the gain matrix.
struct Deflection {
  std::uint32_t sequence{};
  std::array<std::int32_t, 3> channels_nm{};
  bool clipped{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("sequence", self.sequence, "the probe's own sample counter; a gap means samples were lost");
    field("channels_nm", self.channels_nm, "nm at unit gain, channels a, b, c");
    field("clipped", self.clipped, "1 when a channel is at the end of its range");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

// One reading of a drift (screw extension) sensor.
struct Drift {
  Axis axis{};
  std::int32_t reading_nm{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("axis", self.axis, "0 X, 1 Y, 2 Z: whose screw");
    field("reading_nm", self.reading_nm, "nm, free end of the screw against its sensor");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

// Reports the present time. It drives ages, holdover, staleness and time-outs when no other events arrive.
struct TimeAdvanced {
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) { field("at", self.at, "ns, monotonic, of this boot"); }
};

enum class Source : std::uint8_t { sync = 0, trigger = 1, encoders = 2, probe = 3, drift = 4, queue = 5 };
enum class LossReason : std::uint8_t { disconnected = 0, overrun = 1, taken = 2, queue_full = 3 };

// Reports that a source has disappeared, or lost events without a gap in a sequence number.
struct SourceLost {
  Source source{};
  LossReason reason{};
  std::uint32_t lost{};
  MonoTime at{};
  std::uint8_t axes{};  // axisBit() of each axis whose encoder it was
  static constexpr void fields(auto& self, auto&& field) {
    field("source", self.source, "0 sync, 1 trigger, 2 encoders, 3 probe, 4 drift, 5 the capture queue");
    field("reason", self.reason, "0 disconnected, 1 overrun, 2 taken by another process, 3 queue full");
    field("lost", self.lost, "events known to be lost, 0 when unknown");
    field("at", self.at, "ns, monotonic, of this boot");
    field("axes", self.axes, "of encoders: bit 0 X, 1 Y, 2 Z, 3 A, 4 B, 5 C; 0: all of them");
  }
  template <class AnyAxis>
  constexpr bool concerns(AnyAxis axis) const {
    return axes == 0 || (axes & axisBit(axis)) != 0;
  }
};

// Reports the machine position of a homed axis at standstill.
struct AxisHomed {
  Axis axis{};
  double position_mm{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("axis", self.axis, "0 X, 1 Y, 2 Z");
    field("position_mm", self.position_mm, "mm, machine position at this moment; the axis stands still");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

// Reports the begin or end of a cut. During a cut no result comes into force.
struct CutInhibit {
  bool active{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("active", self.active, "1 while nothing may change");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

// The last correction served before the box stopped; the machine's axes may still be displaced by it.
struct AppliedRestored {
  std::array<double, kLinearAxes> correction_mm{};
  MonoTime at{};
  std::array<double, kLinearAxes> doubt_mm{};
  static constexpr void fields(auto& self, auto&& field) {
    field("correction_mm", self.correction_mm, "mm, machine axes X Y Z, radius");
    field("at", self.at, "ns, monotonic, of this boot");
    field("doubt_mm", self.doubt_mm, "mm, to either side: how far from it the axes may stand");
  }
};

// Bounds of the correction, already stored on disk: nothing beyond them may be served.
struct ServableWithin {
  std::array<double, kLinearAxes> least_mm{};
  std::array<double, kLinearAxes> greatest_mm{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("least_mm", self.least_mm, "mm, machine axes X Y Z, radius");
    field("greatest_mm", self.greatest_mm, "mm, machine axes X Y Z, radius");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

// Selects the sources of corrections that are summed.
struct SourcesEnabled {
  std::uint16_t mask{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("mask", self.mask, kSourceBits);
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

// The encoder counts of one rotary axis, latched by its counter.
struct AngleCount {
  RotaryAxis axis{};
  std::uint32_t sequence{};
  std::int64_t counts{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("axis", self.axis, "0 A, 1 B, 2 C");
    field("sequence", self.sequence, "counts every latch of this axis; a gap means latches were lost");
    field("counts", self.counts, "encoder counts; their size is in machine.toml");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

// Reports the angles of rotary axes and the tool in the spindle, as sent by the controller.
struct PoseTold {
  std::uint8_t axes{};
  std::array<double, kRotaryAxes> angles_rad{};
  bool has_tool{};
  std::uint32_t tool{};
  double tool_length_mm{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("axes", self.axes, "whose angles are told: bit 0 A, 1 B, 2 C");
    field("angles_rad", self.angles_rad, "rad, A B C, in the senses of the control");
    field("has_tool", self.has_tool, "1 when the tool is told");
    field("tool", self.tool, "its number, 0 for none");
    field("tool_length_mm", self.tool_length_mm, "mm; 0: as machine.toml has it by its number");
    field("at", self.at, "ns, monotonic, of this boot");
  }
};

// The order defines the type numbers in the journal: append only.
using Event = std::variant<TimeAdvanced, Edge, Count, Deflection, Drift, Marker, SourceLost, ProcedureStarted,
                           ProcedureAborted, Solved, DelayActivated, CountedDeflection, CentrelineActivated,
                           ScrewActivated, AxisHomed, CutInhibit, AppliedRestored, SourcesEnabled, AngleCount, PoseTold,
                           SwivelActivated, RotaryActivated, ErrorsAtAngle, ServableWithin, ToolLengthActivated,
                           CountedAxes, CountedIndex, ControlPositions, ScrewReferenceActivated, CountedEdge>;
static_assert(std::is_trivially_copyable_v<Event>, "events pass through lock-free queues");

inline MonoTime stampOf(const Event& event) {
  return std::visit([](const auto& e) { return e.at; }, event);
}

}  // namespace probebox
