#pragma once
#include <cstdint>
#include <string>

#include "firmware/store/set_aside.hpp"

namespace probebox::app {

struct Boots {
  std::uint16_t count{};
  std::string problem;  // for a person; empty without one
};

// Counts the starts of the box in a file of the state directory, so that a controller notices a restart. 1 at the first
// start. If the file is lost or cannot be written, a random number, which nearly always differs from the last one.
Boots countBoot(const std::string& path, store::Before before = store::Before::perhaps);

}  // namespace probebox::app
