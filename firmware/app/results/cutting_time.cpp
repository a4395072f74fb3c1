#include "firmware/app/results/cutting_time.hpp"

#include <array>
#include <charconv>
#include <chrono>
#include <cstdio>

namespace probebox::app {

// A counter that was lost begins at 0: what was measured before it is due at a time that is not known (results::dueOf).
CuttingTime::CuttingTime(const std::string& path, store::Before before)
    : file_{store::TwinFile::open(path, 32, "0", before)}, problem_{file_.notice()} {
  const auto& text = file_.content();
  std::from_chars(text.data(), text.data() + text.size(), kept_s_);
  total_s_ = kept_s_;
}

void CuttingTime::look(const box::State& state) {
  const auto& snapshot = state.snapshot;
  // A line whose level has not come yet counts as a cut for results, but nothing has been cut.
  const bool cuts = snapshot.inhibited && snapshot.unknown_inhibit_lines == 0;
  if (before_ && cuts && state.at > *before_) {
    total_s_ = total_s_ + std::chrono::duration<double>(state.at - *before_).count();
    if (total_s_ - kept_s_ >= kKeptEvery_s) keep();
  }
  if (!cuts && total_s_ > kept_s_) keep();
  before_ = state.at;
}

void CuttingTime::keep() {
  if (total_s_ <= kept_s_) return;
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.0f", total_s_.load());
  const auto written = file_.write(text.data());
  const std::lock_guard lock{mutex_};
  problem_ = written ? "" : "The hours of cutting are not kept: " + written.error().what;
  kept_s_ = total_s_;
}

}  // namespace probebox::app
