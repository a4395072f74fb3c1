#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

#include "board/describe/box.hpp"
#include "board/describe/machine.hpp"
#include "board/describe/probe.hpp"
#include "board/describe/service.hpp"
#include "board/describe/world.hpp"
#include "protocol/units/outcome.hpp"

// Strict reading of the descriptions. An unknown key, a wrong type, a missing key, a value out of its range or a
// doubtful unit is an error that names file, line and remedy; all problems of a file are told at once, one a line.
namespace probebox::board {

struct Descriptions {
  Box box;
  Machine machine;
  Probe probe;
  Service service;
  std::optional<World> world;  // only a board that is emulated has one
};

// `file_name` is for messages only.
Outcome<Box> parseBox(std::string_view text, std::string_view file_name);
Outcome<Machine> parseMachine(std::string_view text, std::string_view file_name);
Outcome<Probe> parseProbe(std::string_view text, std::string_view file_name);
Outcome<Service> parseService(std::string_view text, std::string_view file_name);
Outcome<World> parseWorld(std::string_view text, std::string_view file_name);

// Which of the box's triggers the tool-setting device is wired to; nothing without a device, or without its trigger.
std::optional<std::uint8_t> lineOfToolSetter(const Box& box, const Machine& machine);

// Reads box.toml, machine.toml, probe.toml, service.toml and, where there is one, world.toml. A file that also stands
// in `overrides` (--config) is read from there instead.
Outcome<Descriptions> loadDirectory(const std::filesystem::path& directory,
                                    const std::filesystem::path& overrides = {});

// The emulated board that is compiled in: the files of board/sim. `overrides` as above.
Outcome<Descriptions> simDescriptions(const std::filesystem::path& overrides = {});

}  // namespace probebox::board
