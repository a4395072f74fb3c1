#pragma once
#include <optional>
#include <string>
#include <vector>

#include "board/describe/service.hpp"
#include "drivers/tcp/address.hpp"
#include "firmware/app/wiring/options.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// The addresses of a run: those of the command line where it names any, else those of service.toml.
const std::vector<std::string>& linksOf(const Options& options, const board::Service& service);
const std::vector<std::string>& cncLinesOf(const Options& options, const board::Service& service);

// Says what is wrong with these addresses, one problem a line, each with the place where it is written: no address, a
// path that is no serial line, a device twice, a link that other computers reach and that is not for reading only.
// Opens nothing, and takes a device that is not there yet.
std::optional<Error> whyNoAddresses(const Options& options, const board::Service& service);

// Why a listener here is refused: other computers reach it, nobody who comes over a network can be told from anybody
// else, and its door (null where service.toml has none) is not `read_only`. docs/decisions/0009-doors.md.
std::optional<Error> whyOpenToAll(const tcp::Address& address, const board::Door* door);

}  // namespace probebox::app
