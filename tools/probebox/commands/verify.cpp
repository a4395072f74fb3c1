#include <vector>

#include "tools/probebox/commands/commands.hpp"
#include "tools/probebox/link/box.hpp"
#include "tools/probebox/link/read_through.hpp"

namespace probebox::command {
namespace {

Json summary(const Verify& options, const RecordingSums& sums, const link::RecordingEnd& end,
             const std::vector<std::string>& faults) {
  return {{"recording", options.input},
          {"whole", faults.empty()},
          {"faults", faults},
          {"size_bytes", end.bytes},
          {"frames", end.frames.frames},
          {"damaged_frames", end.frames.bad()},
          {"missing_frames", end.frames_missing},
          {"stray_frames", end.faults.strays},
          {"baseless_frames", end.faults.baseless},
          {"keyless_blocks", end.faults.keyless_blocks},
          {"unreadable_blocks", end.faults.unreadable_blocks},
          {"cut_bytes", end.cut_bytes},
          {"end_known", end.closed},
          {"received_samples", sums.received},
          {"declared_lost_samples", sums.declared_lost},
          {"lost_on_link_samples", sums.lost_on_link},
          {"repeated_samples", sums.repeated},
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
  RecordingSums sums;
  const auto end = readThrough(options.input, sums, console, {.shows_progress = true});
  if (!end) return conclude(end.error(), console);
  auto faults = faultsOf(sums, *end);
  // A table has one row for each all the same.
  if (sums.repeated > 0)
    faults.push_back(std::to_string(sums.repeated) + (sums.repeated == 1 ? " sample is" : " samples are") +
                     " in it twice: a recording was joined with itself, or with another one of the same time");
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
