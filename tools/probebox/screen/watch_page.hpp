#pragma once
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "protocol/messages/control.hpp"
#include "protocol/messages/handshake.hpp"
#include "protocol/messages/stream.hpp"
#include "tools/probebox/screen/peak_history.hpp"
#include "tools/probebox/screen/span.hpp"
#include "tools/probebox/text/machine_verdict.hpp"
#include "tools/probebox/text/sample_tally.hpp"

namespace probebox::command {

// Everything that `watch` shows. Empty fields have not been received yet.
struct WatchState {
  struct Channel {
    std::string name;  // such as deflection_a
    std::string unit;
    double value{};
    PeakHistory history;
  };

  messages::Descriptor descriptor;
  std::vector<Channel> channels;
  std::optional<messages::Heartbeat> beat;
  SampleTally::Sums sums;  // since the start of the box
  bool balanced{true};
  std::uint64_t restarts{};  // of the box, while it was watched
  std::uint64_t reconnections{};
  MonoTime newest{};  // sample
  std::optional<messages::Trigger> trigger;
  std::optional<messages::Corrections::Answer> corrections;
  std::optional<messages::Status::Answer> status;
  std::optional<messages::ProcedureStatus::Answer> procedure;
  std::optional<messages::ResultSummary> result;  // the newest
  bool link_up{true};
  bool held{};       // the display is paused
  std::string note;  // the last event of the link
  MachineVerdict verdict;
  bool machine_page{};  // shown alone, on a terminal that has no room for it beside the live page
};

// From so many columns on the Machine page stands beside the live one.
inline constexpr std::size_t kColumnsForBoth = 150;

// Lays out the page, or says what size it needs. Every number has a fixed place. utf8: bars may use block characters.
std::vector<Span> watchPage(const WatchState& state, ScreenSize size, bool utf8);

}  // namespace probebox::command
