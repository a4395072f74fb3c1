#pragma once
#include <string>
#include <thread>

#include "firmware/app/cnc/cnc_face.hpp"
#include "firmware/app/cnc/modbus_server.hpp"
#include "firmware/app/cnc/wishes.hpp"
#include "firmware/app/log/log.hpp"
#include "firmware/app/threads/time_source.hpp"

namespace probebox::app {

// Serves a controller that is a Modbus master.
class CncLine final : public CncFace {
 public:
  CncLine(const ModbusOptions& options, const board::Access& may, StateBuffer& states, const CncColleagues& colleagues);
  ~CncLine() override;

  void start() override;
  messages::CncLineStatus status() const override;
  std::uint64_t rounds() const override { return server_.rounds(); }

 private:
  bool take(std::span<const Event> said);
  bool keep(modbus::WordOrder order);
  const published::Snapshot& toBeServed();
  published::LineState lineState();

  board::Access may_;
  StateBuffer& states_;
  CncColleagues with_;
  std::string device_;
  std::string door_;  // name in the DoorBook
  TimeSource time_;
  LimitedWarning refused_{std::chrono::seconds{10}};  // a master may repeat a refused write at every cycle
  Wishes wishes_;
  modbus::RegisterImage::Results features_of_;  // results in force that features_ were found with
  published::KnownFeatures features_;
  ModbusServer server_;
  std::thread thread_;
};

}  // namespace probebox::app
