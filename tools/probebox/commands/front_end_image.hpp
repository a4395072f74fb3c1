#pragma once
#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

#include "protocol/units/outcome.hpp"

namespace probebox::command {

// A UF2 file of the front end's program that has been checked.
struct FrontEndImage {
  std::uint16_t version{};
  std::size_t flash_bytes{};
};

// Why a file is no program of the front end: `name` for a program, `what` for a person.
struct ImageFault {
  std::string name;
  std::string what;
};

// Checks the blocks of a UF2 file, the chip that they are for, the checksum of boot2 and the mark of the program.
Outcome<FrontEndImage, ImageFault> checkFrontEndImage(std::string_view file);

}  // namespace probebox::command
