#pragma once
#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "drivers/tcp/address.hpp"
#include "protocol/messages/control.hpp"
#include "protocol/units/outcome.hpp"
#include "tools/link/client.hpp"

// Shows a box at work without any hardware, live, and checks what it shows.
namespace probebox::tour {

// True values of the emulated machine, which the box has to measure.
struct Truth {
  double tau_s{};
  double effective_diameter_mm{};  // datum sphere and stylus ball
  double drift_ppm{};
  std::array<double, 2> centre_mm{};  // of the part's axis C at the height of the first ball, X Y
};

// Writes a world.toml with delays and a place of the part's axis drawn from `seed`, and with sensors that lose samples
// now and then. Everything else is the emulated board's own.
Outcome<Truth> writeWorld(const std::filesystem::path& folder, std::uint64_t seed);

// Prints the results of the tour beside the truth and decides its exit status.
class ClosingTable {
 public:
  // Adds an estimate beside the truth; it is right within 4 standard deviations.
  void estimate(const std::string& what, const messages::NamedValue& found, double truth);
  // Adds a finding that is right or wrong.
  void exact(const std::string& what, const std::string& found, bool right);

  bool allRight() const;
  void print() const;

 private:
  struct Row {
    std::string what;
    std::string found;
    std::string expected;
    bool right{};
  };
  std::vector<Row> rows_;
};

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
