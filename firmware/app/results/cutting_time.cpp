#include "firmware/app/results/cutting_time.hpp"

#include <array>
#include <chrono>
#include <cstdio>
#include <random>

namespace probebox::app {
namespace {

std::string notKept(const std::string& why) {
  return "The hours of cutting are not kept: " + why;
}

// Of another name than any before.
results::CuttingCount newCount() {
  std::array<char, 12> text{};
  std::snprintf(text.data(), text.size(), "%08x", static_cast<unsigned>(std::random_device{}()));
  return {0, text.data()};
}

}  // namespace

CuttingTime::CuttingTime(const std::string& path, store::Before before)
    : file_{store::TwinFile::open(path, 64, newCount().text(), before)}, problem_{file_.notice()} {
  auto count = results::CuttingCount::parse(file_.content());
  if (!count) {
    count = newCount();
    if (const auto written = file_.write(count->text()); !written) problem_ = notKept(written.error().what);
  }
  counter_ = count->counter;
  total_s_ = kept_s_ = count->s;
}

void CuttingTime::look(const box::State& state) {
  const auto& snapshot = state.snapshot;
  const bool cuts = snapshot.cutting;
  if (before_ && cuts && state.at > *before_) {
    total_s_ = total_s_ + std::chrono::duration<double>(state.at - *before_).count();
  }
  if (total_s_ - kept_s_ >= (cuts ? kKeptEvery_s : kKeptAfterCut_s)) keep();
  before_ = state.at;
}

void CuttingTime::keep() {
  if (total_s_ <= kept_s_) return;
  const auto written = file_.write(count().text());
  const std::lock_guard lock{mutex_};
  problem_ = written ? "" : notKept(written.error().what);
  kept_s_ = total_s_;
}

}  // namespace probebox::app
