#pragma once
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>

#include "board/describe/box.hpp"
#include "board/describe/machine.hpp"
#include "board/describe/probe.hpp"
#include "board/describe/service.hpp"
#include "board/describe/unit.hpp"
#include "board/describe/world.hpp"
#include "protocol/units/outcome.hpp"

// Reads the descriptions strictly. An unknown or missing key, a wrong type, a value out of range, a doubtful unit or an
// unprintable text is an error that names file, line, key and remedy. All problems are reported, one per line.
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
Outcome<Unit> parseUnit(std::string_view text, std::string_view file_name);

// Finds the trigger that the tool-setting device is wired to; nothing without a device or without its trigger.
std::optional<std::uint8_t> lineOfToolSetter(const Box& box, const Machine& machine);
// The same of a touch-trigger probe.
std::optional<std::uint8_t> lineOfProbeSwitch(const Box& box, const Probe& probe);

// Reads box.toml, machine.toml, probe.toml, service.toml and, if it exists, world.toml; files in `overrides` (--config)
// replace them. Reads ordinary files only, up to the longest length of a description.
Outcome<Descriptions> loadDirectory(const std::filesystem::path& directory,
                                    const std::filesystem::path& overrides = {});

// The emulated board that is compiled in: the files of board/sim. `overrides` as above.
Outcome<Descriptions> simDescriptions(const std::filesystem::path& overrides = {});
// The emulated lathe of X and Z: the files of board/sim-lathe, and of board/sim where it has none.
Outcome<Descriptions> simLatheDescriptions(const std::filesystem::path& overrides = {});

}  // namespace probebox::board
