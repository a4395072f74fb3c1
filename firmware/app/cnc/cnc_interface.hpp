#pragma once
#include <cstdint>
#include <string>

#include "firmware/app/host/control_request_handler.hpp"
#include "firmware/app/host/link_service.hpp"
#include "firmware/app/results/connection_inhibits.hpp"
#include "firmware/app/results/due_dates.hpp"
#include "firmware/app/results/last_served_file.hpp"
#include "firmware/app/threads/core_thread.hpp"
#include "protocol/messages/status.hpp"

namespace probebox::app {

// One line or port of a controller, served in a thread of its own, so lines do not delay each other.
class CncInterface {
 public:
  CncInterface() = default;
  virtual ~CncInterface() = default;
  CncInterface(const CncInterface&) = delete;
  CncInterface& operator=(const CncInterface&) = delete;

  virtual void start() = 0;
  // Any thread:
  virtual messages::CncLineStatus status() const = 0;
  virtual std::uint64_t rounds() const = 0;
};

struct CncDependencies {
  ControlRequestHandler& handler;
  LinkService& links;
  ConnectionInhibits& connections;
  LastServedFile& served;
  const Calibrations& calibrations;
  std::uint16_t boots{};
  std::string revision{};  // of the firmware
  const DueDates* due{};   // null: nothing is ever due
};

}  // namespace probebox::app
