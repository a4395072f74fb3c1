#pragma once
#include <atomic>
#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/tcp/linux_tcp.hpp"
#include "firmware/app/cnc/register_server.hpp"
#include "firmware/app/threads/event_loop.hpp"
#include "firmware/app/threads/wake_up.hpp"
#include "firmware/modbus/tcp_requests.hpp"
#include "protocol/units/outcome.hpp"

namespace probebox::app {

struct ModbusTcpOptions {
  tcp::Address address;
  modbus::WordOrder words{};  // of all masters: one that chooses would choose for the others
};

// "HOST:PORT[,words=high-first|low-first]"
Outcome<ModbusTcpOptions> parseModbusTcpOptions(std::string_view text);

// Serves the register map on the network in its own thread. Whatever unit a request names is answered: the address is
// the box. All masters share the registers that they write.
class ModbusTcpServer final : public RegisterServer {
 public:
  // Masters that may be connected at once. A further one replaces the one that has been silent for longest, so that
  // masters that vanished do not block new ones. Connections that have sent no request yet are replaced first, so that
  // port scans displace no master; then those of the computer that has most. A computer that has half of all replaces
  // its own.
  static constexpr std::size_t kMostMasters = 8;

  // revision: of the firmware, for device identification.
  ModbusTcpServer(tcp::Listener listener, std::string revision, Callbacks callbacks);

  void run() override;
  void stop() override { stop_.notify(); }
  ModbusCounters counters() const override;
  std::uint64_t rounds() const override { return rounds_; }

 private:
  struct Master {
    std::unique_ptr<io::BytePipe> pipe;
    modbus::TcpRequests requests;
    bool has_asked{};
    std::uint64_t heard{};  // turn of its last request
    EventLoop::Watch watch;
    bool gone{};
  };

  void accept();
  void makeRoomFor(std::string_view computer);
  void receive(Master& master);
  void answer(Master& master, modbus::TcpRequest& asked);
  void dismiss(Master& master, const std::string& why);

  tcp::Listener listener_;
  const std::string name_;
  const std::function<void(const std::string&)> report_;
  const std::function<void()> round_;
  RegisterHandler handler_;
  WakeUp stop_;
  EventLoop loop_;
  std::vector<std::unique_ptr<Master>> masters_;
  std::uint64_t turn_{};

  std::atomic<std::uint64_t> rounds_{};
  std::atomic<std::uint64_t> answered_{};
  std::atomic<std::uint64_t> refused_{};
  std::atomic<std::uint64_t> unsent_{};
  std::atomic<std::uint64_t> bad_frames_{};
  std::atomic<std::uint64_t> skipped_bytes_{};
};

}  // namespace probebox::app
