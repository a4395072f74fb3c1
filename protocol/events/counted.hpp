#pragma once
#include <array>
#include <cstdint>

#include "protocol/events/axes.hpp"
#include "protocol/units/time.hpp"

// Events that another device has numbered on its own counter. firmware/clock assigns their time.
namespace probebox {

// One sample of a probe receiver that counts samples on its own oscillator. firmware/clock assigns its time.
struct CountedDeflection {
  std::uint8_t run{};
  std::uint32_t counter{};
  std::array<std::int32_t, 3> channels_nm{};
  bool clipped{};
  bool newest{};
  MonoTime at{};
  static constexpr void fields(auto& self, auto&& field) {
    field("run", self.run, "another value than before: the counter began anew");
    field("counter", self.counter, "the receiver's own sample counter, wraps; a gap means samples were lost");
    field("channels_nm", self.channels_nm, "nm at unit gain, channels a, b, c");
    field("clipped", self.clipped, "1 when a channel is at the end of its range");
    field("newest", self.newest,
          "1 when it was the last sample taken before `at`: only then `at` tells about its time");
    field("at", self.at, "ns, monotonic, of this boot: when the sample arrived, which is later than it was taken");
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
  static constexpr void fields(auto& self, auto&& field) {
    field("run", self.run, "another value than before: the receiver began anew, and its counts do not go on");
    field("counter", self.counter, "the receiver's sample counter: that of the deflection before");
    field("axes", self.axes, "whose counts there are: bit 0 X, 1 Y, 2 Z, 3 A, 4 B, 5 C");
    field("counts", self.counts, "encoder counts, X Y Z A B C; their size is in machine.toml");
    field("faults", self.faults, "axes, as above, whose counter has lost counts since the last sample that was sent");
    field("at", self.at, "ns, monotonic, of this boot: when the sample arrived, which is later than it was taken");
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
  static constexpr void fields(auto& self, auto&& field) {
    field("run", self.run, "that of the sample before the pulse");
    field("counter", self.counter, "the receiver's sample counter: the last sample before the pulse");
    field("fraction", self.fraction, "from that sample to the pulse, in 2^-32 of a sample period");
    field("axis", self.axis, "0 X, 1 Y, 2 Z, 3 A, 4 B, 5 C");
    field("counts", self.counts, "encoder counts at the pulse");
    field("at", self.at, "ns, monotonic, of this boot: when the packet arrived");
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

}  // namespace probebox
