#pragma once
#include <atomic>
#include <mutex>
#include <optional>
#include <string>

#include "firmware/box/state.hpp"
#include "firmware/results/due.hpp"
#include "firmware/store/twin_file.hpp"

namespace probebox::app {

// Counts how long the machine has cut, as lines and connections say it, over all starts of the box.
class CuttingTime {
 public:
  // A power cut loses at most kKeptEvery_s of what was counted, and kKeptAfterCut_s when no cut is on. An inhibit that
  // ends with every block must not write to the flash at each.
  static constexpr double kKeptEvery_s = 360, kKeptAfterCut_s = 60;

  CuttingTime(const std::string& path, store::Before before);

  // For the worker's thread: counts the time since the state before while a cut is on.
  void look(const box::State& state);
  // At the end of the daemon.
  void finish() { keep(); }
  // Any thread.
  results::CuttingCount count() const { return {total_s_, counter_}; }
  // Why it is not kept; empty when it is. Any thread.
  std::string problem() const {
    const std::lock_guard lock{mutex_};
    return problem_;
  }

 private:
  void keep();

  store::TwinFile file_;
  std::string counter_;
  std::optional<MonoTime> before_;
  std::atomic<double> total_s_{};
  double kept_s_{};
  mutable std::mutex mutex_;
  std::string problem_;
};

}  // namespace probebox::app
