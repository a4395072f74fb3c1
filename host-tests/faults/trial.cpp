#include "host-tests/faults/trial.hpp"

#include <filesystem>
#include <sys/wait.h>

#include "host-tests/faults/announcements.hpp"
#include "host-tests/faults/store_room.hpp"
#include "host-tests/faults/supervised.hpp"
#include "host-tests/support/temporary_folder.hpp"

namespace probebox::faults {
namespace {

std::string whyEndedBadly(const Ended& ended) {
  if (ended.hung) return "it hangs";
  if (WIFSIGNALED(ended.status)) return "it died of signal " + std::to_string(WTERMSIG(ended.status));
  return WEXITSTATUS(ended.status) == 0 ? "" : "it ended with status " + std::to_string(WEXITSTATUS(ended.status));
}

Decision noFault(const Call& /*call*/) {
  return {};
}

// Hears everything in a boot without a fault. Why it did not end well, or refused a change.
std::optional<std::string> whySoundBootFails(const std::filesystem::path& folder, Acknowledged& acknowledged) {
  const auto refused = acknowledged.refused();
  const auto ended = supervise(
      folder, [&](const Say& say) { runStoreRoom(folder, say); }, noFault);
  std::string why;
  for (const auto& line : ended.said) {
    acknowledged.hear(line);
    if (line.starts_with("failed ")) why = line;
  }
  if (auto badly = whyEndedBadly(ended); !badly.empty()) return badly;
  return acknowledged.refused() == refused ? std::nullopt : std::optional{why};
}

std::optional<std::string> whyLost(const std::filesystem::path& folder, const Acknowledged& acknowledged,
                                   const Acknowledged::After& after) {
  const auto ended = supervise(
      folder, [&](const Say& say) { reportStoreRoom(folder, say); }, noFault);
  if (auto badly = whyEndedBadly(ended); !badly.empty()) return badly;
  return acknowledged.whyBroken(ended.said, after);
}

}  // namespace

std::string_view name(Before before) {
  return before == Before::nothing ? "first-boot" : "third-boot";
}

std::string describe(const Trial& trial) {
  return std::string{name(trial.fault)} + " at call " + std::to_string(trial.call) + " of the " +
         std::string{name(trial.before)};
}

Outcome perform(const Trial& trial) {
  const support::TemporaryFolder scratch;
  const auto folder = scratch.path() / "state";
  std::filesystem::create_directory(folder);
  Acknowledged acknowledged;
  for (int boots = trial.before == Before::two_boots ? 2 : 0; boots > 0; --boots)
    if (auto why = whySoundBootFails(folder, acknowledged)) return {.broken = "without a fault: " + *why};
  FaultyDisk disk{trial.fault, trial.call, folder};
  const auto ended = supervise(
      folder, [&](const Say& say) { runStoreRoom(folder, say); }, [&](const Call& call) { return disk.decide(call); });
  for (const auto& line : ended.said) acknowledged.hear(line);
  Outcome outcome{.reached = disk.reached(),
                  .applies = disk.applies(),
                  .at = disk.at(),
                  .changes = acknowledged.changes(),
                  .refused = acknowledged.refused()};
  if (!outcome.applies) return outcome;
  if (const auto badly = whyEndedBadly(ended); !ended.killed && !badly.empty()) {
    outcome.broken = badly;
    return outcome;
  }
  const bool cut = cutsPower(trial.fault) || (!ended.killed && trial.call % 2 == 1);
  if (cut) {
    disk.cutPower();
    std::error_code none;
    std::filesystem::remove(folder / kInMemory, none);
  }
  const Acknowledged::After after{
      .power_was_cut = cut, .disk_died = trial.fault == Fault::fail_for_good, .folder_failed = disk.folderFailed()};
  outcome.broken = whyLost(folder, acknowledged, after);
  if (outcome.broken) return outcome;
  Acknowledged later;
  if (const auto why = whySoundBootFails(folder, later)) outcome.broken = "the next boot: " + *why;
  return outcome;
}

}  // namespace probebox::faults
