#pragma once
#include <string>
#include <thread>

#include "firmware/app/cnc/cnc_face.hpp"
#include "firmware/app/cnc/text_server.hpp"
#include "firmware/app/log/log.hpp"
#include "firmware/app/threads/time_source.hpp"

namespace probebox::app {

// Serves a controller that sends and reads text.
class TextLine final : public CncFace {
 public:
  TextLine(const TextOptions& options, const board::Access& may, StateBuffer& states, const CncColleagues& colleagues);
  ~TextLine() override;

  void start() override;
  messages::CncLineStatus status() const override;
  std::uint64_t rounds() const override { return server_.rounds(); }

 private:
  void compare(const tape::Positions& reached);

  board::Access may_;
  StateBuffer& states_;
  CncColleagues with_;
  std::string device_;
  std::string door_;  // name in the DoorBook
  TimeSource time_;
  LimitedWarning warnings_{std::chrono::seconds{10}};
  LimitedWarning reached_{std::chrono::seconds{1}, logInfo};
  TextServer server_;
  std::thread thread_;
};

}  // namespace probebox::app
