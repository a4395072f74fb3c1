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

// Keeps a serial line open: opens it when the device appears, and reopens it without limit. Attempts are separated by a
// pause, even if the line opens and closes at once.
class LastingLine {
 public:
  using Open = std::function<Outcome<std::unique_ptr<io::BytePipe>>()>;
  using Report = std::function<void(const std::string&)>;

  static constexpr std::chrono::milliseconds kFirstPause{50};
  static constexpr std::chrono::milliseconds kLongestPause{2000};

  // report: receives messages for a person: the line is lost, or is back.
  LastingLine(const serial::Address& address, Report report);
  // The same with another function that opens the line. name: for reports.
  LastingLine(std::string name, Open open, Report report);

  // Calls `serve` repeatedly while the line is open, until stop(). `serve` has to wait for the line and for wakeUp().
  void run(const std::function<void()>& serve);
  void stop();  // from any thread

  // Opens the line now, to report a wrong device or setting at the start.
  Outcome<void> open();
  // Tests whether the line is open, and opens it when an attempt is due. False: wait for pause().
  bool opened();
  std::chrono::milliseconds pause();

  io::BytePipe* pipe() const { return pipe_.get(); }  // null while it is closed
  // Call when bytes have come: only they prove that the line works again.
  void heard() { pause_ = kFirstPause; }
  // Call when the line was closed.
  void lost();

  int wakeUp() const { return wake_up_.descriptor(); }  // readable after stop()
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
