#include "drivers/iio/frame_counter.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::iio {
namespace {

// 200 ppm over so many periods is a quarter of a period: beyond, the number of missing frames would be a guess.
constexpr double kMostBelieved = 1250;
// A frame this near to its time is regular.
constexpr double kRegular = 0.3;
// How fast the expected time follows the stamps, and how much one stamp may move it, in periods.
constexpr double kFollow = 1.0 / 8;
constexpr double kMostMove = 1.0 / 8;

}  // namespace

std::optional<FrameCounter::Number> FrameCounter::push(MonoTime at) {
  const auto held = held_;
  held_ = at;
  if (!held) return std::nullopt;
  return decide(*held, at);
}

FrameCounter::Number FrameCounter::decide(MonoTime held, MonoTime next) {
  if (!due_) {
    due_ = held;
    judged_from_ = held;
    return last_;
  }
  const auto periods = [&](MonoTime at) { return static_cast<double>((at - *due_).count()) / period_ns_; };
  // A stamp that is late by itself does not push the next frame away.
  const double steps = std::max(1.0, std::min(std::round(periods(held)), std::round(periods(next)) - 1));
  if (steps > kMostBelieved) {
    due_ = held;
    last_ = {static_cast<std::uint8_t>(last_.run + 1), 0};
    judged_ = regular_ = 0;
    judged_from_ = held;
    return last_;
  }
  const double off = periods(held) - steps;
  const double moved = steps + kFollow * std::clamp(off, -kMostMove, kMostMove);
  due_ = *due_ + Nanoseconds{std::llround(moved * period_ns_)};
  last_.counter += static_cast<std::uint32_t>(steps);
  missing_ += static_cast<std::uint64_t>(steps) - 1;
  judge(steps == 1 && std::abs(off) < kRegular, held);
  return last_;
}

void FrameCounter::judge(bool regular, MonoTime at) {
  regular_ += regular ? 1 : 0;
  if (++judged_ < kJudged) return;
  wrong_rate_hz_.reset();
  if (2 * regular_ < kJudged) wrong_rate_hz_ = 1e9 * kJudged / static_cast<double>((at - judged_from_).count());
  judged_ = regular_ = 0;
  judged_from_ = at;
}

void FrameCounter::startRun(std::uint8_t run) {
  held_.reset();
  due_.reset();
  last_ = {run, 0};
  judged_ = regular_ = 0;
  wrong_rate_hz_.reset();
}

}  // namespace probebox::iio
