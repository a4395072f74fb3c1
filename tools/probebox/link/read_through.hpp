#pragma once
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "protocol/units/outcome.hpp"
#include "tools/link/recording.hpp"
#include "tools/probebox/cli/console.hpp"
#include "tools/probebox/text/sample_tally.hpp"

namespace probebox::command {

struct ReadingOptions {
  bool shows_progress{};
  link::EnoughRead enough{};
};

// Reads a recording for a command; "-" is the standard input. Trouble: it cannot be read, or Ctrl-C has ended the
// reading; the listener has received what came before.
Outcome<link::RecordingEnd, Trouble> readThrough(const std::string& path, link::StreamListener& listener,
                                                 Console& console, const ReadingOptions& options = {});

// Reports a failure and returns its exit status; an interruption by Ctrl-C is not reported.
ExitStatus conclude(const Trouble& trouble, Console& console);

// Sums the samples, losses and triggers of a recording over all of its links, and judges how each link follows the one
// before.
struct RecordingSums : link::StreamListener {
  void onWelcome(const messages::Welcome& welcome) override;
  void onBlock(const link::DecodedBlock& block) override;
  void onGap(const messages::Gap& gap) override;
  void onHole(const messages::Gap& hole) override;
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) override;
  void onTrigger(const messages::Trigger&) override { ++triggers.received; }
  void onTriggerGap(const messages::TriggerGap& gap) override { triggers.declared_lost += gap.count; }
  void onTriggerHole(const messages::TriggerGap& hole) override { triggers.inferred_lost += hole.count; }
  std::uint64_t received{}, declared_lost{}, heartbeats{}, inexact{};
  std::uint64_t lost_on_link{};     // in holes, and before the first sample of a stream
  std::uint64_t missing_between{};  // after a link without a closing ledger, before the first sample of the next
  std::uint64_t repeated{};         // of a recording that follows the closing ledger of one with the same samples
  std::uint64_t ends_unknown{};     // streams without a closing ledger that a restart of the box ended
  link::TriggerAccount triggers;

 private:
  template <class Tell>
  void follow(std::uint64_t count, Tell tell);

  SampleTally joined_;
  bool open_{};         // samples came after the last closing ledger
  bool follows_end_{};  // the link that is read began behind a closing ledger
};

// Explains each fault of a recording to a person; empty when it is complete and exact.
std::vector<std::string> faultsOf(const RecordingSums& sums, const link::RecordingEnd& end);

// Reports that a recording is not whole, with every fault and what was made of the rest, and returns the exit status;
// ok without a word where it is whole.
ExitStatus tellFaults(const std::string& input, const std::string& rest, const RecordingSums& sums,
                      const link::RecordingEnd& end, Console& console);

}  // namespace probebox::command
