#include "firmware/app/threads/chain_watch.hpp"

#include <algorithm>
#include <utility>

namespace probebox::app {

ChainWatch::ChainWatch(std::vector<std::string> stages, MonoTime now) : looked_at_{now} {
  for (auto& name : stages) stages_.push_back({.name = std::move(name), .moved_at = now});
}

ChainWatch::Finding ChainWatch::look(std::span<const std::uint64_t> progress, MonoTime now, Nanoseconds patience) {
  Finding finding;
  const bool was_stopped = now - std::exchange(looked_at_, now) > patience;
  for (std::size_t i = 0; i < stages_.size(); ++i) {
    Stage& stage = stages_[i];
    const bool moved = progress[i] != stage.count;
    stage.count = progress[i];
    stage.went_on = stage.went_on || moved;
    if (moved || was_stopped) stage.moved_at = now;
    const bool stands_still = now - stage.moved_at > patience;
    if (std::exchange(stage.stands_still, stands_still) != stands_still) finding.changed = true;
    if (stands_still) finding.standing_still.push_back(stage.name);
  }
  finding.all_went_on = std::ranges::all_of(stages_, &Stage::went_on);
  if (finding.all_went_on) {
    for (auto& stage : stages_) stage.went_on = false;
  }
  return finding;
}

}  // namespace probebox::app
