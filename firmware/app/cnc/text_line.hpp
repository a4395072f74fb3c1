#pragma once
#include <string>
#include <thread>

#include "firmware/app/cnc/text_server.hpp"
#include "firmware/app/host/control_desk.hpp"
#include "firmware/app/log/log.hpp"
#include "firmware/app/results/served_record.hpp"
#include "firmware/app/threads/core_thread.hpp"
#include "firmware/app/threads/time_source.hpp"

namespace probebox::app {

// A serial line of a control that speaks text, in a thread of its own.
class TextLine {
 public:
  // may: what the controller may do.
  TextLine(const TextOptions& options, const board::Access& may, StateBuffer& states, ControlDesk& desk,
           ServedRecord& served);
  ~TextLine();
  TextLine(const TextLine&) = delete;
  TextLine& operator=(const TextLine&) = delete;

  void start();

  // Any thread:
  const std::string& device() const { return device_; }
  TextCounters counters() const { return server_.counters(); }
  std::uint64_t rounds() const { return server_.rounds(); }

 private:
  published::Snapshot toBeServed();
  void compare(const tape::Positions& reached);

  board::Access may_;
  StateBuffer& states_;
  ControlDesk& desk_;
  ServedRecord& served_;
  std::string device_;
  std::string door_;  // in the book
  TimeSource time_;
  LimitedWarning warnings_{std::chrono::seconds{10}};
  LimitedWarning reached_{std::chrono::seconds{1}, logInfo};
  TextServer server_;
  std::thread thread_;
};

}  // namespace probebox::app
