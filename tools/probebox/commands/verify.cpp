#include <vector>

#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/read_through.hpp"

namespace probebox::command {
namespace {

// What the recording itself says of its samples, over all of its links.
struct Sums : link::StreamListener {
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

// Why it is not whole, each for a person; empty when it is.
std::vector<std::string> faultsOf(const Sums& sums, const link::RecordingEnd& end) {
  std::vector<std::string> faults;
  const auto say = [&](std::uint64_t count, const std::string& what) {
    if (count > 0) faults.push_back(std::to_string(count) + what);
  };
  say(end.frames.bad(), " frames are damaged");
  say(end.frames_missing, " frames are missing, with " + std::to_string(sums.lost_on_link) + " samples");
  say(end.faults.malformed, " frames do not contain a message of their type");
  say(end.faults.other_major, " frames are of another protocol version");
  say(end.faults.unreadable_blocks, " blocks cannot be read: their descriptor is missing or their coding unknown");
  say(end.unexplained, " samples are missing and not declared lost");
  say(sums.inexact, " heartbeats do not balance: received + declared lost differs from produced");
  if (!end.triggers_exact) faults.emplace_back("the numbers of its triggers do not agree with its heartbeats");
  if (end.cut_bytes > 0) {
    faults.push_back("it is cut in the middle of a frame, which begins at byte " +
                     std::to_string(end.bytes - end.cut_bytes) + " of " + std::to_string(end.bytes));
  }
  if (!end.closed) {
    faults.push_back("it ends before its stream did: the samples from sample " + std::to_string(end.next.index) +
                     " on is unknown");
  }
  return faults;
}

Json summary(const Verify& options, const Sums& sums, const link::RecordingEnd& end,
             const std::vector<std::string>& faults) {
  return {{"recording", options.input},
          {"whole", faults.empty()},
          {"faults", faults},
          {"size_bytes", end.bytes},
          {"frames", end.frames.frames},
          {"damaged_frames", end.frames.bad()},
          {"missing_frames", end.frames_missing},
          {"unreadable_blocks", end.faults.unreadable_blocks},
          {"cut_bytes", end.cut_bytes},
          {"end_known", end.closed},
          {"received_samples", sums.received},
          {"declared_lost_samples", sums.declared_lost},
          {"lost_on_link_samples", sums.lost_on_link},
          {"received_triggers", sums.triggers.received},
          {"declared_lost_triggers", sums.triggers.declared_lost},
          {"lost_on_link_triggers", sums.triggers.inferred_lost},
          {"heartbeats", sums.heartbeats},
          {"unbalanced_heartbeats", sums.inexact}};
}

}  // namespace

ExitStatus run(const Verify& asked, const std::string& given, Console& console) {
  const auto recording = chooseRecording(asked.input, given);
  if (!recording) return console.fail(recording.error());
  const Verify options{*recording};
  Sums sums;
  const auto end = readThrough(options.input, sums, console, {.shows_progress = true});
  if (!end) return conclude(end.error(), console);
  const auto faults = faultsOf(sums, *end);
  if (console.json()) {
    console.object(summary(options, sums, *end, faults));
  } else {
    console.line(options.input + ": " + std::to_string(end->frames.frames) + " frames, " +
                 std::to_string(sums.received) + " samples received, " + std::to_string(sums.declared_lost) +
                 " declared lost" + (faults.empty() ? "; whole, every heartbeat balances" : ""));
    for (const auto& fault : faults) console.line("  " + fault);
  }
  return faults.empty() ? ExitStatus::ok : ExitStatus::failed;
}

}  // namespace probebox::command
