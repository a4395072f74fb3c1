#pragma once
#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

#include "drivers/io/kernel_clock.hpp"
#include "protocol/messages/handshake.hpp"

namespace probebox::app {

// What a box knows of the date: many boards have no clock that survives a power cut.
struct WallClock {
  bool is_kept_right{true};  // synchronised, set from a hardware clock, or that of an emulated box
  std::uint64_t start{};     // of the box, counted; 0: not known yet
};

// A time of day that a host has told, carried on by the box's own clock.
class ToldTime {
 public:
  // by: the connection. since_start: of the box, when it was told.
  ToldTime(const messages::TimeOfDay& time, std::chrono::microseconds since_start, std::string by);

  std::chrono::sys_seconds at(std::chrono::microseconds since_start) const;
  // The most that it may be off, s: of the host's clock, of the way to the box, of the box's own clock since then.
  // Nothing where the host does not know how far off its clock is.
  std::optional<double> error_s(std::chrono::microseconds since_start) const;
  // Where a date comes from, for the record.
  std::string source(std::chrono::microseconds since_start) const;
  bool isBetterThan(const ToldTime& other, std::chrono::microseconds since_start) const;
  const std::string& by() const { return by_; }
  // From now on its error is not known.
  void doubt() { time_.error_ms = messages::TimeOfDay::kErrorUnknown; }

 private:
  messages::TimeOfDay time_;
  std::chrono::microseconds told_;
  std::string by_;
};

// The times of day that hosts have told.
class ToldTimes {
 public:
  // Takes one, unless it cannot be or the one before is better. Returns what the log should say of it; empty: nothing.
  // Once two have contradicted each other, those and all later ones are doubted: which clock is wrong is not known.
  std::string take(const messages::TimeOfDay& time, std::chrono::microseconds since_start, std::string by);
  const std::optional<ToldTime>& best() const { return best_; }

 private:
  std::optional<ToldTime> best_;
  bool is_in_doubt_{};
};

struct Date {
  std::optional<std::chrono::sys_seconds> at;  // where the box can know it
  std::string text;                            // ISO 8601, or "unknown, 12 s after start 7"
  std::string source;                          // where it comes from and how sure it is, for the record; or "unknown"
};

// By the kernel's clock where that is kept right and shows a date that can be, else by what a host has told.
Date dateOf(const io::KernelClock& kernel, const WallClock& clock, const std::optional<ToldTime>& told,
            std::chrono::microseconds since_start);

// Tells dateNow() what the box knows. Before the first call every date that can be is believed.
void setWallClock(const WallClock& clock);
// Takes the time of day that a host has told (ToldTimes), for as long as nothing keeps the kernel's clock right. by:
// the connection that it came over.
void noteTold(const messages::TimeOfDay& time, std::string by);
Date dateNow();
std::string utcNow();  // its text

}  // namespace probebox::app
