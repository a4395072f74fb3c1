#pragma once
#include <cstdint>
#include <string>

#include "protocol/messages/types.hpp"

// Measurements of the box itself.
namespace probebox::messages {

// Measures the delay of stamps: the box pulses an output that is wired to one of its inputs.
struct LoopBack {
  static constexpr Operation kOperation = Operation::loop_back;
  // Limits how long other requests to the store have to wait.
  static constexpr std::uint32_t kMostPulses = 2000;
  struct Request {
    std::uint32_t pulses{};
    static constexpr void fields(auto& self, auto&& field) {
      field("pulses", self.pulses, "how many, 10 to 2000; 0: 500");
    }
  };
  struct Answer {
    std::string output{};
    std::string input{};
    std::uint32_t pulses{};
    std::uint32_t lost{};
    std::int64_t median_ns{};
    std::int64_t p99_ns{};
    std::int64_t largest_ns{};
    std::int64_t bracket_ns{};
    std::int64_t sigma_ns{};
    static constexpr void fields(auto& self, auto&& field) {
      field("output", self.output, "for a person, such as gpiochip0 line 10 (loop-back output)");
      field("input", self.input, "the line that it is joined to");
      field("pulses", self.pulses, "made; fewer than asked for when the lines are slow");
      field("lost", self.lost, "of them: no edge was stamped within 10 ms");
      field("median_ns", self.median_ns,
            "ns, how late an edge is stamped, counted from just before the write that makes it: too much by up to "
            "bracket_ns");
      field("p99_ns", self.p99_ns, "ns, 99 of 100 are stamped no later");
      field("largest_ns", self.largest_ns, "ns, the latest one");
      field("bracket_ns", self.bracket_ns, "ns, what the write takes (median): the edge is somewhere in it");
      field("sigma_ns", self.sigma_ns, "ns, spread of the lateness: 1.4826 times its median absolute deviation");
    }
  };
};

}  // namespace probebox::messages
