#include "firmware/app/cnc/lasting_line.hpp"

#include <algorithm>
#include <utility>

#include "drivers/serial/linux_serial.hpp"

namespace probebox::app {

LastingLine::LastingLine(const serial::Address& address, Report report)
    : LastingLine{address.path, [address] { return serial::openSerial(address.path, address.settings); },
                  std::move(report)} {}

LastingLine::LastingLine(std::string name, Open open, Report report)
    : name_{std::move(name)}, open_{std::move(open)}, report_{std::move(report)} {}

void LastingLine::run(const std::function<void()>& serve) {
  while (!stopped_) {
    ++rounds_;
    if (opened())
      serve();
    else
      wake_up_.wait(pause());
  }
  pipe_.reset();
}

void LastingLine::stop() {
  stopped_ = true;
  wake_up_.notify();
}

Outcome<void> LastingLine::open() {
  TRY(auto pipe, open_());
  pipe_ = std::move(pipe);
  return {};
}

bool LastingLine::opened() {
  if (pipe_) return true;
  if (std::exchange(must_pause_, false)) return false;
  const auto good = open();
  if (!good) {
    if (!was_lost_) report_(good.error().what + "; trying again until it is there");
    was_lost_ = true;
    return false;
  }
  if (was_lost_) {
    ++reopened_;
    report_(name_ + ": the line is back");
  }
  was_lost_ = false;
  return true;
}

std::chrono::milliseconds LastingLine::pause() {
  return std::exchange(pause_, std::min(2 * pause_, kLongestPause));
}

void LastingLine::lost() {
  pipe_.reset();
  was_lost_ = must_pause_ = true;
  report_(name_ + ": the line was closed; opening it again");
}

}  // namespace probebox::app
