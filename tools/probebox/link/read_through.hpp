#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/units/outcome.hpp"
#include "tools/link/recording.hpp"
#include "tools/probebox/cli/console.hpp"

namespace probebox::command {

struct ReadingWishes {
  bool shows_progress{};
  link::EnoughRead enough{};
};

// Reads a recording for a command; "-" is the standard input. Trouble: it cannot be read, or Ctrl-C has ended the
// reading; the listener has received what came before.
Outcome<link::RecordingEnd, Trouble> readThrough(const std::string& path, link::StreamListener& listener,
                                                 Console& console, const ReadingWishes& wishes = {});

// Reports a failure and returns its exit status; an interruption by Ctrl-C is not reported.
ExitStatus conclude(const Trouble& trouble, Console& console);

// Sums the samples, losses and triggers of a recording over all of its links.
struct RecordingSums : link::StreamListener {
  void onBlock(const link::DecodedBlock& block) override { received += block.header.count; }
  void onGap(const messages::Gap& gap) override { declared_lost += gap.count; }
  void onHole(const messages::Gap& hole) override { lost_on_link += hole.count; }
  void onHeartbeat(const messages::Heartbeat&, const std::optional<link::Balance>& balance) override {
    if (!balance) return;
    ++heartbeats;
    inexact += !balance->exact;
  }
  void onTrigger(const messages::Trigger&) override { ++triggers.received; }
  void onTriggerGap(const messages::TriggerGap& gap) override { triggers.declared_lost += gap.count; }
  void onTriggerHole(const messages::TriggerGap& hole) override { triggers.inferred_lost += hole.count; }
  std::uint64_t received{}, declared_lost{}, lost_on_link{}, heartbeats{}, inexact{};
  link::TriggerAccount triggers;
};

// Explains each fault of a recording to a person; empty when it is complete and exact.
std::vector<std::string> faultsOf(const RecordingSums& sums, const link::RecordingEnd& end);

}  // namespace probebox::command
