#pragma once
#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "protocol/messages/nothing.hpp"
#include "protocol/messages/types.hpp"
#include "protocol/state/snapshot.hpp"
#include "protocol/units/correction_sources.hpp"

// Reports the corrections that the CNC is given, with their sources and limits.
namespace probebox::messages {

using published::ValueSource;

// A value that the box uses, and where it comes from.
struct ValueInUse {
  std::string name{};
  ValueSource source{};
  std::uint64_t result_id{};
  static constexpr void fields(auto& self, auto&& field) {
    field("name", self.name, "such as tool length, stylus offset 1 or checked ball");
    field("source", self.source,
          "0 unknown, 1 the description (machine.toml), 2 a result in force, 3 the controller has sent it");
    field("result_id", self.result_id, "of the result; 0 unless source is 2", published::Identifier{});
  }
};

struct Corrections {
  static constexpr Operation kOperation = Operation::corrections;
  using Request = Nothing;
  struct Answer : published::CorrectionsState {
    bool delay_applied{};
    bool centreline_of_slide{};
    std::vector<ValueInUse> in_use{};
    static constexpr void fields(auto& self, auto&& field) {
      CorrectionsState::fields(self, field);
      field("delay_applied", self.delay_applied, "1 when the samples have the delay in force");
      field("centreline_of_slide", self.centreline_of_slide,
            "1 when the centreline is that of a chuck which the Z slide carries: its slope is the slide's, not the "
            "direction of C");
      field("in_use", self.in_use, "values in use, and where they come from");
    }
  };
};

// The controller has homed axes: they stand still at known machine positions.
struct HomeAxes {
  static constexpr Operation kOperation = Operation::home_axes;
  struct Request {
    std::uint8_t axes{};
    std::array<double, 3> position_mm{};
    std::string by{};
    static constexpr void fields(auto& self, auto&& field) {
      field("axes", self.axes, "which were homed: bit 0 X, 1 Y, 2 Z");
      field("position_mm", self.position_mm, "mm, machine position where it stands");
      field("by", self.by, "the person who says so, for the log; empty for a controller");
    }
  };
  using Answer = Nothing;
};

// The controller reports the angles of its rotary axes and the tool in the spindle.
struct TellPose {
  static constexpr Operation kOperation = Operation::tell_pose;
  struct Request {
    std::uint8_t axes{};
    std::array<double, 3> angles_rad{};
    bool has_tool{};
    std::uint32_t tool{};
    double tool_length_mm{};
    static constexpr void fields(auto& self, auto&& field) {
      field("axes", self.axes, "whose angles are told: bit 0 A, 1 B, 2 C");
      field("angles_rad", self.angles_rad, "rad, A B C, in the senses of the control; up to 20 pi, ten turns");
      field("has_tool", self.has_tool, "1 when the tool is told");
      field("tool", self.tool, "its number, 0 for none");
      field("tool_length_mm", self.tool_length_mm, "mm; 0: as machine.toml has it by its number");
    }
  };
  using Answer = Nothing;
};

// Positions of axes that the controller knows, for axes with encoder kind "control" in box.toml.
struct TellPositions {
  static constexpr Operation kOperation = Operation::tell_positions;
  struct Request {
    std::uint8_t run{};
    std::uint32_t counter{};
    std::uint8_t axes{};
    std::array<std::int64_t, 6> counts{};
    static constexpr void fields(auto& self, auto&& field) {
      field("run", self.run,
            "another value each time that the counter begins anew: axes that are not absolute lose their reference");
      field("counter", self.counter,
            "the controller's own counter or time stamp at these positions, at counter_rate_hz of box.toml; wraps");
      field("axes", self.axes, "whose positions are told: bit 0 X, 1 Y, 2 Z, 3 A, 4 B, 5 C");
      field(
          "counts", self.counts,
          "X Y Z A B C, in counts as machine.toml has them: nm at counts_per_mm = 1_000_000. A B C may go on from 360 "
          "to 0 degrees, and back");
    }
  };
  using Answer = Nothing;
};

// Selects the sources that are summed from now on. After a restart those of machine.toml apply.
struct EnableSources {
  static constexpr Operation kOperation = Operation::enable_sources;
  struct Request {
    std::uint16_t mask{};
    static constexpr void fields(auto& self, auto&& field) { field("mask", self.mask, kSourceBits); }
  };
  using Answer = Nothing;
};

}  // namespace probebox::messages
