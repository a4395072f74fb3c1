#include "host-tests/faults/trial.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <filesystem>
#include <sys/wait.h>

#include "host-tests/faults/disk_image.hpp"
#include "host-tests/faults/store_room.hpp"
#include "host-tests/faults/supervised.hpp"
#include "host-tests/support/temporary_folder.hpp"

namespace probebox::faults {
namespace {

using Kind = Call::Kind;
using What = Decision::What;

constexpr std::array<std::string_view, kFaults> kNames{"kill",          "cut-lost", "cut-torn", "fail-once",
                                                       "fail-for-good", "full",     "shorten"};

// A file in place takes what it has room for.
bool needsRoom(const Call& call) {
  std::error_code none;
  if (call.kind == Kind::make_folder) return true;
  if (call.kind == Kind::open) return call.creates && !std::filesystem::exists(call.path, none);
  if (call.kind != Kind::write) return false;
  const auto size = std::filesystem::file_size(call.path, none);
  return none || call.offset + call.bytes.size() > size;
}

std::string whyEndedBadly(const Ended& ended) {
  if (ended.hung) return "it hangs";
  if (WIFSIGNALED(ended.status)) return "it died of signal " + std::to_string(WTERMSIG(ended.status));
  return WEXITSTATUS(ended.status) == 0 ? "" : "it ended with status " + std::to_string(WEXITSTATUS(ended.status));
}

class FaultyBoot {
 public:
  FaultyBoot(const Trial& trial, const std::filesystem::path& folder)
      : trial_{trial}, folder_{folder}, image_{folder} {}

  Decision decide(const Call& call) {
    const auto decision = decisionAbout(call);
    if (decision.what == What::pass) image_.note(call);
    if (decision.what == What::shorten) image_.note(call, call.bytes.size() / 2);
    if (decision.what == What::fail) folder_failed_ |= call.kind == Kind::open && call.path == folder_;
    return decision;
  }

  // The computer's end: what the disk has is what is left.
  void cutPower() {
    const auto fate = trial_.fault == Fault::cut_torn ? DiskImage::Unsynced::torn : DiskImage::Unsynced::lost;
    image_.cutPower(fate, trial_.call);
    std::error_code none;
    std::filesystem::remove(folder_ / "served-last", none);  // it lies in memory
    power_was_cut_ = true;
  }

  Acknowledged::After after() const {
    return {.power_was_cut = power_was_cut_,
            .disk_died = trial_.fault == Fault::fail_for_good,
            .folder_failed = folder_failed_};
  }
  const Outcome& outcome() const { return outcome_; }

 private:
  Decision decisionAbout(const Call& call) {
    const bool of_the_disk =
        trial_.fault != Fault::kill && trial_.fault != Fault::cut_lost && trial_.fault != Fault::cut_torn;
    if (of_the_disk && call.path.ends_with("served-last")) return {};  // it lies in memory
    ++calls_;
    if (calls_ == trial_.call) {
      outcome_.reached = outcome_.applies = true;
      outcome_.at = describe(call);
    }
    if (calls_ < trial_.call) return {};
    switch (trial_.fault) {
      case Fault::kill:
      case Fault::cut_lost:
      case Fault::cut_torn:
        return {.what = What::kill};
      case Fault::fail_once:
        return calls_ == trial_.call ? Decision{.what = What::fail, .error = EIO} : Decision{};
      case Fault::fail_for_good:
        return {.what = What::fail, .error = EIO};
      case Fault::full:
        return needsRoom(call) ? Decision{.what = What::fail, .error = ENOSPC} : Decision{};
      case Fault::shorten:
        if (calls_ != trial_.call) return {};
        outcome_.applies = call.kind == Kind::write && call.at_offset && call.bytes.size() > 1;
        return outcome_.applies ? Decision{.what = What::shorten} : Decision{};
    }
    return {};
  }

  Trial trial_;
  std::filesystem::path folder_;
  DiskImage image_;
  Outcome outcome_;
  std::size_t calls_{};
  bool folder_failed_{};
  bool power_was_cut_{};
};

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

std::string_view name(Fault fault) {
  return kNames.at(static_cast<std::size_t>(fault));
}

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
  FaultyBoot boot{trial, folder};
  const auto ended = supervise(
      folder, [&](const Say& say) { runStoreRoom(folder, say); }, [&](const Call& call) { return boot.decide(call); });
  for (const auto& line : ended.said) acknowledged.hear(line);
  auto outcome = boot.outcome();
  outcome.changes = acknowledged.changes();
  outcome.refused = acknowledged.refused();
  if (!outcome.applies) return outcome;
  if (const auto badly = whyEndedBadly(ended); !ended.killed && !badly.empty()) {
    outcome.broken = badly;
    return outcome;
  }
  const bool cut = trial.fault == Fault::cut_lost || trial.fault == Fault::cut_torn;
  if (cut || (!ended.killed && trial.call % 2 == 1)) boot.cutPower();
  outcome.broken = whyLost(folder, acknowledged, boot.after());
  if (outcome.broken) return outcome;
  Acknowledged later;
  if (const auto why = whySoundBootFails(folder, later)) outcome.broken = "the next boot: " + *why;
  return outcome;
}

}  // namespace probebox::faults
