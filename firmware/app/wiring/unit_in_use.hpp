#pragma once
#include <filesystem>
#include <optional>

#include "board/describe/parse.hpp"
#include "firmware/app/host/unit_request_handler.hpp"
#include "firmware/app/wiring/options.hpp"

namespace probebox::app {

// Opens the identity of the box in the folder `state`, and applies it to the descriptions.
UnitRequestHandler takeUnit(const std::filesystem::path& state, board::Descriptions& descriptions);

// Reads it beside a daemon that may be running. Nothing where there is none; one that cannot be read is said in the
// log.
std::optional<board::Unit> unitOf(const Options& options);

}  // namespace probebox::app
