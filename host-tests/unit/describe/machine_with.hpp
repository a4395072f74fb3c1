#pragma once
#include <gtest/gtest.h>
#include <string>
#include <string_view>

#include "board/describe/parse.hpp"

namespace probebox::board {

// A machine with three linear axes, and what else is said.
inline Outcome<Machine> machineWith(std::string_view more, std::string_view sources = "") {
  std::string text = "[machine]\nname = \"m\"\n[corrections]\nhold_s = 5\n" + std::string{sources};
  for (const auto* const axis : {"X", "Y", "Z"}) {
    text += std::string{"[axis."} + axis + "]\ncounts_per_mm = 1000\nsense = 1\ntravel_min_mm = -1000\n" +
            "travel_max_mm = 1000\ncorrection_limit_mm = 1\ncorrection_rate_mm_s = 0.1\n";
  }
  return parseMachine(text + std::string{more}, "machine.toml");
}

inline std::string machineProblem(std::string_view more) {
  const auto machine = machineWith(more);
  EXPECT_FALSE(machine.ok()) << more;
  return machine.ok() ? "" : machine.error().what;
}

}  // namespace probebox::board
