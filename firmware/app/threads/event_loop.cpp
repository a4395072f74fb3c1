#include "firmware/app/threads/event_loop.hpp"

#include <sys/epoll.h>
#include <system_error>
#include <systemd/sd-event.h>
#include <utility>

namespace probebox::app {

struct EventLoop::Watch::Entry {
  std::function<void()> call;
  sd_event_source* source{};
  std::uint64_t period_us{};

  static int onDescriptor(sd_event_source*, int, std::uint32_t, void* entry) {
    static_cast<Entry*>(entry)->call();
    return 0;
  }
  static int onTime(sd_event_source* source, std::uint64_t due_us, void* entry) {
    auto* self = static_cast<Entry*>(entry);
    // After a long sleep one call is enough: periods that went by are not made up for.
    std::uint64_t now_us = due_us;
    sd_event_now(sd_event_source_get_event(source), CLOCK_MONOTONIC, &now_us);
    sd_event_source_set_time(source, now_us + self->period_us);
    self->call();
    return 0;
  }
};

void EventLoop::Watch::Release::operator()(Entry* entry) const {
  sd_event_source_disable_unref(entry->source);
  delete entry;
}

void EventLoop::Watch::wantWrite(bool wanted) {
  if (entry_)
    sd_event_source_set_io_events(entry_->source, static_cast<std::uint32_t>(wanted ? EPOLLIN | EPOLLOUT : EPOLLIN));
}

void EventLoop::Watch::pause() {
  if (entry_) sd_event_source_set_enabled(entry_->source, SD_EVENT_OFF);
}

EventLoop::EventLoop() : loop_{nullptr} {
  if (const int result = sd_event_new(&loop_); result < 0)
    throw std::system_error{-result, std::generic_category(), "sd_event_new"};
}

EventLoop::~EventLoop() {
  sd_event_unref(loop_);
}

EventLoop::Watch EventLoop::watch(int descriptor, std::function<void()> ready) {
  Watch watch;
  watch.entry_.reset(new Watch::Entry{.call = std::move(ready)});
  const int result = sd_event_add_io(loop_, &watch.entry_->source, descriptor, EPOLLIN, &Watch::Entry::onDescriptor,
                                     watch.entry_.get());
  if (result < 0) throw std::system_error{-result, std::generic_category(), "sd_event_add_io"};
  return watch;
}

EventLoop::Watch EventLoop::every(std::chrono::milliseconds period, std::function<void()> due) {
  const auto period_us = static_cast<std::uint64_t>(std::chrono::microseconds{period}.count());
  Watch watch;
  watch.entry_.reset(new Watch::Entry{.call = std::move(due), .period_us = period_us});
  int result = sd_event_add_time_relative(loop_, &watch.entry_->source, CLOCK_MONOTONIC, period_us, 1000,
                                          &Watch::Entry::onTime, watch.entry_.get());
  if (result >= 0) result = sd_event_source_set_enabled(watch.entry_->source, SD_EVENT_ON);
  if (result < 0) throw std::system_error{-result, std::generic_category(), "sd_event_add_time"};
  return watch;
}

void EventLoop::run() {
  sd_event_loop(loop_);
}
void EventLoop::quit() {
  sd_event_exit(loop_, 0);
}

}  // namespace probebox::app
