#pragma once
#include <cstdint>

#include "tools/probebox/link/box.hpp"

namespace probebox::command {

// Duration, size and losses of a stream of samples received for trial.
struct StreamTrial {
  double seconds{};
  std::uint64_t samples{};
  std::uint64_t bytes{};  // of their frames
  std::uint64_t lost_at_source{}, lost_in_queue{}, lost_on_link{};
  bool balances{};  // the box counts the same
  messages::Status::Answer before, after;
  SampleIndex first{};  // of the samples
  messages::BootId boot_id{};
};

// Receives all samples at the configured rate.
Outcome<StreamTrial, Trouble> tryStream(const link::Uri& uri, double seconds, Console& console);

// How fast the link brings what the box has kept.
struct BacklogTrial {
  double seconds{};
  std::uint64_t bytes{};
  double bytesPerSecond() const { return seconds > 0 ? static_cast<double>(bytes) / seconds : 0; }
};

// Asks for the samples of `stream` once more, uncompressed: they come as fast as the link takes them, for 5 s at most.
Outcome<BacklogTrial, Trouble> tryBacklog(const link::Uri& uri, const StreamTrial& stream, Console& console);

}  // namespace probebox::command
