#pragma once
#include <cstdint>
#include <string>

#include "tools/probebox/link/box.hpp"

namespace probebox::command {

// Which result is accepted, by whom, and whether a large difference from the result in force is intended.
struct Acceptance {
  std::uint64_t id{};
  std::string by;
  bool although_it_differs{};
};

// Shows the result beside the one in force and accepts it. If they differ by more than 4 sd, a person at a terminal is
// asked to confirm; a script needs although_it_differs.
ExitStatus acceptOn(link::Client& box, const Acceptance& acceptance, Console& console);

}  // namespace probebox::command
