#include "firmware/app/threads/core_thread.hpp"

#include <algorithm>
#include <chrono>
#include <pthread.h>

namespace probebox::app {

CoreThread::CoreThread(const box::BoxConfig& config, EventQueue& events, CommandQueue& commands, WakeUp& wake_up,
                       Counters& counters)
    : box_{config, *this}, events_{events}, commands_{commands}, wake_up_{wake_up}, counters_{counters} {}

CoreThread::~CoreThread() {
  stop();
}

StateBuffer& CoreThread::addStateReader() {
  return *readers_.emplace_back(std::make_unique<StateBuffer>());
}

EventQueue& CoreThread::openJournal() {
  constexpr std::size_t kJournalBytes = 4 * 1024 * 1024;
  journal_ = std::make_unique<EventQueue>(kJournalBytes);
  return *journal_;
}

void CoreThread::tellBeforeStart(std::span<const Event> events, MonoTime now) {
  for (const auto& event : events) take(event);
  box_.showBeforeStart(now);
}

void CoreThread::start(Worker& worker, WakeUp& links) {
  worker_ = &worker;
  links_ = &links;
  thread_ = std::thread{[this] { run(); }};
  pthread_setname_np(thread_.native_handle(), "core");
}

void CoreThread::stop() {
  if (!thread_.joinable()) return;
  stopping_ = true;
  wake_up_.notify();
  thread_.join();
}

std::optional<std::uint32_t> CoreThread::takeRunToSolve() {
  std::uint32_t run = 0;
  return runs_to_solve_.pop(run) ? std::optional{run} : std::nullopt;
}

void CoreThread::run() {
  constexpr std::chrono::milliseconds kAtMost{50};
  Event event;
  while (!stopping_) {
    wake_up_.wait(kAtMost);
    // Events first: a command never overtakes what was stamped before it.
    while (events_.pop(event)) {
      take(event);
      ++counters_.progress.core;
    }
    while (commands_.pop(event)) {
      take(event);
      commands_.setApplied();
    }
  }
}

void CoreThread::take(const Event& event) {
  if (journal_ && !journal_->push(event)) ++counters_.journal_lost_events;
  box_.push(event);
}

bool CoreThread::block(SampleIndex first, std::uint32_t count, std::span<const std::byte> bytes) {
  item_.kind = FeedItem::Kind::block;
  item_.first = first;
  item_.count = count;
  item_.delay = box_.delayInSamples();
  item_.tool = box_.toolInSamples();
  item_.next_trigger = box_.nextTrigger();
  item_.size = static_cast<std::uint32_t>(bytes.size());
  std::copy(bytes.begin(), bytes.end(), item_.bytes.begin());
  return feedItem();
}

bool CoreThread::lost(const latch::Lost& lost) {
  item_.kind = FeedItem::Kind::lost_at_source;
  item_.reason = lost.reason;
  item_.first = lost.first;
  item_.count = static_cast<std::uint64_t>(lost.count);
  item_.size = 0;
  return feedItem();
}

// Where there is no room the next block tells.
void CoreThread::trigger(const box::PlacedTrigger& trigger) {
  item_.kind = FeedItem::Kind::trigger;
  item_.trigger = trigger;
  feed_.push(item_);
  if (links_ != nullptr) links_->notify();
}

// The links hear of every sample in order: what did not fit is told before what comes after it.
bool CoreThread::feedItem() {
  if (unreported_count_ != 0) {
    FeedItem gap;
    gap.kind = FeedItem::Kind::lost_in_queue;
    gap.first = unreported_first_;
    gap.count = unreported_count_;
    if (feed_.push(gap)) unreported_count_ = 0;
  }
  const bool taken = unreported_count_ == 0 && feed_.push(item_);
  if (!taken) {
    if (unreported_count_ == 0) unreported_first_ = item_.first;
    unreported_count_ += item_.count;
  }
  if (links_ != nullptr) links_->notify();
  return taken;
}

void CoreThread::state(const box::State& state) {
  for (const auto& reader : readers_) reader->publish(state);
  commands_.setPublished();
  ++counters_.progress.state;
  if (journal_ && worker_ != nullptr) worker_->notify();
}

void CoreThread::solve(std::uint32_t run) {
  runs_to_solve_.push(run);
  if (worker_ != nullptr) worker_->notify();
}

}  // namespace probebox::app
