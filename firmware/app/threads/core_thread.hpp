#pragma once
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <thread>
#include <vector>

#include "firmware/app/threads/capture_thread.hpp"
#include "firmware/app/threads/command_queue.hpp"
#include "firmware/app/threads/feed.hpp"
#include "firmware/app/threads/triple_buffer.hpp"
#include "firmware/app/threads/wake_up.hpp"
#include "firmware/app/threads/worker.hpp"
#include "firmware/box/box.hpp"

namespace probebox::app {

using StateBuffer = TripleBuffer<box::State>;

// Runs the pure rooms. From popping an event to the published state and the closed block it neither allocates, locks
// nor waits.
class CoreThread : private box::Outputs {
 public:
  CoreThread(const box::BoxConfig& config, EventQueue& events, CommandQueue& commands, WakeUp& wake_up,
             Counters& counters);
  ~CoreThread() override;
  CoreThread(const CoreThread&) = delete;
  CoreThread& operator=(const CoreThread&) = delete;

  // Call before start(). Each reader thread gets its own buffer; everything returned lives as long as this.
  StateBuffer& addStateReader();
  Feed& feed() { return feed_; }
  // Queue of every event in the order of the core, for a journal on the worker.
  EventQueue& openJournal();

  // Applies the events that must precede any reader, and publishes the first state. Call before start().
  void tellBeforeStart(std::span<const Event> events, MonoTime now);

  // Wakes `worker` when a run is ready to be solved or the journal has filled up, and `links` when there are blocks;
  // never waits for them.
  void start(Worker& worker, WakeUp& links);
  void stop();

  // The run to solve; called by the worker.
  std::optional<std::uint32_t> takeRunToSolve();
  // Stable from takeRunToSolve() until the core receives Solved.
  const capture::Recording& recording() const { return box_.recording(); }
  capture::Scales scales() const { return box_.scales(); }
  const procedure::Plan& plan() const { return box_.plan(); }

 private:
  bool block(SampleIndex first, std::uint32_t count, std::span<const std::byte> bytes) override;
  bool lost(const latch::Lost& lost) override;
  void trigger(const box::PlacedTrigger& trigger) override;
  void state(const box::State& state) override;
  void solve(std::uint32_t run) override;

  void run();
  void take(const Event& event);
  bool feedItem();

  box::Box box_;
  EventQueue& events_;
  CommandQueue& commands_;
  WakeUp& wake_up_;
  Counters& counters_;
  Feed feed_{64};
  FeedItem item_;
  SampleIndex unreported_first_{};
  std::uint64_t unreported_count_{};  // samples lost to a full feed and not yet reported to the links
  std::vector<std::unique_ptr<StateBuffer>> readers_;
  std::unique_ptr<EventQueue> journal_;
  Worker* worker_{};
  WakeUp* links_{};
  SpscQueue<std::uint32_t> runs_to_solve_{4};
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace probebox::app
