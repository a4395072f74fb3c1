#include "firmware/app/results/wall_clock.hpp"

#include <array>
#include <cstdio>
#include <mutex>
#include <utility>

#include "firmware/app/log/log.hpp"
#include "protocol/units/calendar.hpp"

namespace probebox::app {
namespace {

using namespace std::chrono;

struct Known {
  std::mutex mutex;
  std::optional<WallClock> clock;
  ToldTimes told;
  const steady_clock::time_point began{steady_clock::now()};

  microseconds sinceStart() const { return floor<microseconds>(steady_clock::now() - began); }
};

Known& known() {
  static Known one;
  return one;
}

std::string within(double error_s) {
  std::array<char, 48> text{};
  std::snprintf(text.data(), text.size(), "within %.3g s", error_s);
  return text.data();
}

std::string sourceOf(const io::KernelClock& clock) {
  if (clock.synchronised)
    return "clock of the computer, synchronised " + within(duration<double>(clock.largest_error).count());
  return clock.from_hardware ? "clock of the computer, set from its hardware clock; error unknown"
                             : "clock of the computer; nothing is known to keep it right";
}

}  // namespace

ToldTime::ToldTime(const messages::TimeOfDay& time, microseconds since_start, std::string by)
    : time_{time}, told_{since_start}, by_{std::move(by)} {}

sys_seconds ToldTime::at(microseconds since_start) const {
  return floor<seconds>(sys_time<microseconds>{microseconds{time_.utc_us}} + (since_start - told_));
}

std::optional<double> ToldTime::error_s(microseconds since_start) const {
  if (time_.error_ms == messages::TimeOfDay::kErrorUnknown) return std::nullopt;
  constexpr double kOnTheWay_s = 2;  // a HELLO is sent again after half a second
  constexpr double kOwnClock = 100e-6;
  return 1e-3 * time_.error_ms + kOnTheWay_s + kOwnClock * duration<double>(since_start - told_).count();
}

std::string ToldTime::source(microseconds since_start) const {
  const auto error = error_s(since_start);
  return "told by a host (" + by_ + "), " + (error ? within(*error) : "error unknown");
}

bool ToldTime::isBetterThan(const ToldTime& other, microseconds since_start) const {
  const auto mine = error_s(since_start), others = other.error_s(since_start);
  return mine && others ? *mine < *others : mine.has_value() || !others;
}

std::string ToldTimes::take(const messages::TimeOfDay& time, microseconds since_start, std::string by) {
  ToldTime told{time, since_start, std::move(by)};
  if (is_in_doubt_) told.doubt();
  if (!couldBeNow(told.at(since_start))) return "";
  if (!best_) {
    best_ = std::move(told);
    return "The time of day is " + isoUtc(best_->at(since_start)) + ", " + best_->source(since_start) + ".";
  }
  const auto error = told.error_s(since_start), error_before = best_->error_s(since_start);
  const auto apart = abs(told.at(since_start) - best_->at(since_start));
  const bool contradict =
      error && error_before && static_cast<double>(apart.count()) > *error + *error_before + 1;  // whole seconds
  std::string said;
  if (contradict) {
    said = "Two hosts tell times of day " + std::to_string(apart.count()) + " s apart (" + best_->by() + ", " +
           told.by() + "): one of their clocks is wrong, and how far dates are off is not known.";
    is_in_doubt_ = true;
    told.doubt();
    best_->doubt();
  }
  if (told.isBetterThan(*best_, since_start)) best_ = std::move(told);
  return said;
}

Date dateOf(const io::KernelClock& kernel, const WallClock& clock, const std::optional<ToldTime>& told,
            microseconds since_start) {
  const auto shown = floor<seconds>(kernel.utc);
  // A board that has the time from a network only is synchronised some time after its start.
  if ((clock.is_kept_right || kernel.isKept()) && couldBeNow(shown)) return {shown, isoUtc(shown), sourceOf(kernel)};
  if (told) return {told->at(since_start), isoUtc(told->at(since_start)), told->source(since_start)};
  const auto which = clock.start != 0 ? "start " + std::to_string(clock.start) : "a start";
  return {std::nullopt, "unknown, " + std::to_string(floor<seconds>(since_start).count()) + " s after " + which,
          "unknown"};
}

void setWallClock(const WallClock& clock) {
  const std::lock_guard lock{known().mutex};
  known().clock = clock;
}

void noteTold(const messages::TimeOfDay& time, std::string by) {
  auto& all = known();
  const std::lock_guard lock{all.mutex};
  if (const auto said = all.told.take(time, all.sinceStart(), std::move(by)); !said.empty()) logInfo(said);
}

Date dateNow() {
  const auto kernel = io::kernelClock();
  auto& all = known();
  const std::lock_guard lock{all.mutex};
  return dateOf(kernel, all.clock.value_or(WallClock{}), all.told.best(), all.sinceStart());
}

std::string utcNow() {
  return dateNow().text;
}

}  // namespace probebox::app
