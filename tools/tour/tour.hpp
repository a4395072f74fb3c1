#pragma once
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "drivers/tcp/address.hpp"
#include "tools/link/client.hpp"
#include "tools/tour/closing_table.hpp"
#include "tools/tour/emulation.hpp"

// Shows a box at work without any hardware, live, and checks what it shows.
namespace probebox::tour {

struct Stage {
  tcp::Address box;
  Truth truth;
  ClosingTable table;
};

// Every part returns why it had to stop, or nothing.
using Stopped = std::optional<Error>;

Outcome<std::unique_ptr<link::Client>> meet(const tcp::Address& box, link::StreamListener* listener);
// Keeps the link alive for a while; false when it is lost.
bool linger(link::Client& client, std::chrono::milliseconds duration);

Stopped showClock(Stage& stage);
// Leaves the delay in force.
Stopped showCalibration(Stage& stage);
// Needs a delay in force.
Stopped showCentreline(Stage& stage);
Stopped showStream(Stage& stage, std::uint64_t seed);
// `port`: the CNC's end of the serial line.
Stopped showRegisters(Stage& stage, const std::filesystem::path& port);

}  // namespace probebox::tour
