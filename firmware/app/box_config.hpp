#pragma once
#include "board/describe/parse.hpp"
#include "firmware/box/box.hpp"
#include "protocol/messages/handshake.hpp"

// From what people described to what the rooms need.
namespace probebox::app {

box::BoxConfig boxConfig(const board::Descriptions& descriptions);
// Without the delay in force, which changes while the box runs.
messages::Descriptor wireDescriptor(const board::Descriptions& descriptions, const std::string& firmware_version);

}  // namespace probebox::app
