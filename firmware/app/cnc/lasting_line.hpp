#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "drivers/io/byte_pipe.hpp"
#include "drivers/serial/settings.hpp"
#include "firmware/app/threads/wake_up.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

// Keeps a serial line open: opens it when it comes, and again after it was closed, without limit. Between two attempts
// is a pause, also where the line opens and is closed at once.
class LastingLine {
 public:
  using Open = std::function<Outcome<std::unique_ptr<io::BytePipe>>()>;
  using Report = std::function<void(const std::string&)>;

  static constexpr std::chrono::milliseconds kFirstPause{50};
  static constexpr std::chrono::milliseconds kLongestPause{2000};

  // report: takes what a person should know: the line is lost, or is back.
  LastingLine(const serial::Address& address, Report report);
  // The same with a way to open it. name: for reports.
  LastingLine(std::string name, Open open, Report report);

  // Calls `serve` again and again while the line is open, until stop(). It waits for the line and for wakeUp().
  void run(const std::function<void()>& serve);
  void stop();  // from any thread

  // Opens it now, to report a wrong device or setting at the start.
  Outcome<void> open();
  // Tests whether it is open, and opens it where it is time to; otherwise comes a pause().
  bool opened();
  std::chrono::milliseconds pause();

  io::BytePipe* pipe() const { return pipe_.get(); }  // null while it is closed
  // Bytes have come: only now has the line really come back.
  void heard() { pause_ = kFirstPause; }
  // It was closed.
  void lost();

  int wakeUp() const { return wake_up_.descriptor(); }  // readable at the end
  // Any thread:
  std::uint64_t rounds() const { return rounds_; }  // rises while run() works, with or without traffic
  std::uint64_t reopened() const { return reopened_; }

 private:
  std::string name_;
  Open open_;
  Report report_;
  std::unique_ptr<io::BytePipe> pipe_;
  std::chrono::milliseconds pause_{kFirstPause};
  bool was_lost_{};
  bool must_pause_{};

  WakeUp wake_up_;
  std::atomic<bool> stopped_{};
  std::atomic<std::uint64_t> rounds_{};
  std::atomic<std::uint64_t> reopened_{};
};

}  // namespace probebox::app
