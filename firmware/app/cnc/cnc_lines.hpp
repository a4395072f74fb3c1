#pragma once
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "firmware/app/cnc/cnc_face.hpp"
#include "firmware/app/cnc/register_server.hpp"
#include "firmware/app/cnc/wishes.hpp"
#include "firmware/app/log/log.hpp"
#include "firmware/app/threads/time_source.hpp"

namespace probebox::app {

// Serves a controller that is a Modbus master.
class CncLine final : public CncFace {
 public:
  // How its masters come, and what they may.
  struct Way {
    std::string kind;  // "modbus"
    std::string name;  // of the device or address
    board::Access may;
    std::optional<modbus::WordOrder> words{};  // of a port on the network; empty: the master of a serial line chooses
    std::function<std::unique_ptr<RegisterServer>(RegisterServer::Faces)> serve;
  };
  CncLine(const Way& way, StateBuffer& states, const CncColleagues& colleagues);
  ~CncLine() override;

  void start() override;
  messages::CncLineStatus status() const override;
  std::uint64_t rounds() const override { return server_->rounds(); }

 private:
  bool take(std::span<const Event> said);
  RegisterServer::Faces faces(std::optional<modbus::WordOrder> words);
  bool mayWish(const modbus::Wish& wish);
  bool keep(modbus::WordOrder order);
  published::LineState lineState(const published::Snapshot& snapshot);

  board::Access may_;
  StateBuffer& states_;
  CncColleagues with_;
  std::string name_;
  std::string door_;  // name in the DoorBook
  TimeSource time_;
  LimitedWarning refused_{std::chrono::seconds{10}};   // a master may repeat a refused write at every cycle
  LimitedWarning reported_{std::chrono::seconds{10}};  // anybody may knock at a port
  Wishes wishes_;
  modbus::RegisterImage::Results features_of_;  // results in force that features_ were found with
  published::KnownFeatures features_;
  std::unique_ptr<RegisterServer> server_;
  std::thread thread_;
};

}  // namespace probebox::app
