#pragma once
#include <functional>
#include <span>
#include <utility>
#include <vector>

#include "firmware/app/cnc/controller_requests.hpp"
#include "firmware/modbus/register_image.hpp"
#include "firmware/modbus/writable_registers.hpp"
#include "host-tests/emulation/boot.hpp"
#include "host-tests/emulation/register_link.hpp"

namespace probebox::scenario {

// The box's side of one Modbus line, as CncLine and ModbusServer put it together, without the line.
class LineOfTheBox {
 public:
  LineOfTheBox(Office& office, Boot& boot) : office_{office}, boot_{boot} {}

  Registers registers() {
    return {[this](std::uint16_t first, std::size_t count) { return read(first, count); },
            [this](std::uint16_t first, std::span<const std::uint16_t> values) { return write(first, values); }};
  }
  // The line was unplugged, or the box restarted.
  void restart() { writable_.restart(); }

 private:
  std::vector<std::uint16_t> read(std::uint16_t first, std::size_t count);
  bool write(std::uint16_t first, std::span<const std::uint16_t> values);
  void ask(messages::Operation operation, const std::vector<std::byte>& body,
           const std::function<void(app::Reply)>& then);

  Office& office_;
  Boot& boot_;
  modbus::WritableRegisters writable_;
  modbus::RegisterImage image_;
  app::ControllerRequests requests_{"controller at line 1",
                                    [this](messages::Operation operation, const std::vector<std::byte>& body,
                                           const std::function<void(app::Reply)>& then) { ask(operation, body, then); },
                                    [this](std::uint64_t result) { return boot_.inForce().isWaiting(result); }};
};

}  // namespace probebox::scenario
