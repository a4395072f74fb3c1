// Masters at full speed on two serial lines and a port, one of them amid noise and cut frames, beside one on the
// network that sends nothing else: every answer is of one instant.
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <functional>
#include <gtest/gtest.h>
#include <memory>
#include <modbus/modbus.h>
#include <optional>
#include <random>
#include <string>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>
#include <vector>

#include "drivers/serial/emulator.hpp"
#include "drivers/tcp/linux_tcp.hpp"
#include "firmware/app/cnc/modbus_server.hpp"
#include "firmware/app/cnc/modbus_tcp_server.hpp"
#include "firmware/app/threads/core_thread.hpp"
#include "host-tests/numbered/snapshot.hpp"
#include "host-tests/support/temporary_folder.hpp"

namespace probebox::app {
namespace {

using namespace std::chrono_literals;

constexpr unsigned kBaud = 115200;
constexpr std::size_t kServers = 3;

struct FreeContext {
  void operator()(modbus_t* context) const {
    modbus_close(context);
    modbus_free(context);
  }
};
using Context = std::unique_ptr<modbus_t, FreeContext>;

// What one master found.
struct Found {
  std::uint64_t answers{};
  std::uint64_t different{};  // numbers, one after the other
  std::optional<std::string> torn;
};

// Reads until it has so many answers. before: called before each request.
Found readAll(modbus_t* master, std::uint64_t wanted, const std::function<void()>& before = {}) {
  Found found;
  std::uint16_t last = 0;
  std::array<std::uint16_t, support::kNumberedRegisters> values{};
  for (std::uint64_t attempts = 0; found.answers < wanted && attempts < 10 * wanted; ++attempts) {
    if (before) before();
    if (modbus_read_registers(master, 0, values.size(), values.data()) != static_cast<int>(values.size())) {
      // The quietest of many gives way to a newer one, and comes again as masters do.
      const bool was_closed = errno == ECONNRESET || errno == EPIPE || errno == EBADF;
      modbus_flush(master);
      if (was_closed) modbus_close(master), modbus_connect(master);
      continue;
    }
    ++found.answers;
    found.different += values[3] != last ? 1U : 0U;
    last = values[3];
    if ((found.torn = support::whyTorn(values))) break;
  }
  return found;
}

class TornReads : public testing::Test {
 protected:
  TornReads() {
    for (auto& cable : cables_) {
      const auto number = std::to_string(&cable - cables_.data());
      auto opened = serial::EmulatedCable::open(folder_.file("box" + number), folder_.file("cnc" + number));
      EXPECT_TRUE(opened) << opened.error().what;
      cable.emplace(std::move(*opened));
      threads_.emplace_back([&cable](const std::stop_token& stop) {
        while (!stop.stop_requested()) cable->pump(2ms);
      });
      const std::size_t server = servers_.size();
      servers_.push_back(std::make_unique<ModbusServer>(
          ModbusOptions{.line = {folder_.file("box" + number), {kBaud, serial::Parity::none, 8, 1}}},
          callbacks(server)));
    }
    auto listener = tcp::Listener::open({.host = "127.0.0.1", .port = 0});
    EXPECT_TRUE(listener) << listener.error().what;
    port_ = listener->address().port;
    servers_.push_back(std::make_unique<ModbusTcpServer>(std::move(*listener), "1.2.3", callbacks(servers_.size())));
    for (auto& server : servers_) threads_.emplace_back([&server] { server->run(); });
    threads_.emplace_back([this](const std::stop_token& stop) { publish(stop); });
  }
  ~TornReads() override {
    for (auto& server : servers_) server->stop();
  }

  // As the core does: one buffer a server.
  void publish(const std::stop_token& stop) {
    box::State state;
    for (std::uint32_t number = 1; !stop.stop_requested(); ++number) {
      state.snapshot = support::numbered(number);
      for (auto& buffer : buffers_) buffer.publish(state);
      std::this_thread::sleep_for(20us);
    }
  }

  RegisterServer::Callbacks callbacks(std::size_t server) {
    return {.registers = {.snapshot = [this, server] { return buffers_.at(server).newest().snapshot; },
                          .take = [](std::span<const Event>) { return false; },
                          .kept = [] { return RegisterHandler::Kept{}; }},
            .report = [](const std::string&) {}};
  }

  Context onLine(std::size_t line) const {
    Context master{modbus_new_rtu(folder_.file("cnc" + std::to_string(line)).c_str(), kBaud, 'N', 8, 1)};
    modbus_set_slave(master.get(), 1);
    return connected(std::move(master));
  }
  Context onNetwork() const { return connected(Context{modbus_new_tcp("127.0.0.1", port_)}); }

  const support::TemporaryFolder folder_;
  std::array<StateBuffer, kServers> buffers_;
  std::array<std::optional<serial::EmulatedCable>, kServers - 1> cables_;
  std::vector<std::unique_ptr<RegisterServer>> servers_;
  int port_{};

 private:
  static Context connected(Context master) {
    EXPECT_EQ(modbus_connect(master.get()), 0) << modbus_strerror(errno);
    modbus_set_response_timeout(master.get(), 0, 150'000);
    return master;
  }

  std::vector<std::jthread> threads_;
};

std::vector<std::uint8_t> noise(std::mt19937_64& random, std::size_t most) {
  std::vector<std::uint8_t> bytes(1 + random() % most);
  for (auto& byte : bytes) byte = static_cast<std::uint8_t>(random());
  return bytes;
}

// The begin of a request, of a length that is drawn.
std::vector<std::uint8_t> cutRequest(std::mt19937_64& random) {
  const auto whole = support::readRequest(0, support::kNumberedRegisters);
  return {whole.bytes.begin(), whole.bytes.begin() + static_cast<std::ptrdiff_t>(1 + random() % (whole.size - 1))};
}

void put(int to, const std::vector<std::uint8_t>& bytes) {
  // A connection that the box has closed takes nothing more.
  [[maybe_unused]] const auto sent = ::send(to, bytes.data(), bytes.size(), MSG_NOSIGNAL) < 0 && errno == ENOTSOCK
                                         ? ::write(to, bytes.data(), bytes.size())
                                         : 0;
}

TEST_F(TornReads, NeverHappenInTenThousandOnLinesAndNetwork) {
  constexpr std::uint64_t kOnLine = 1000, kAmidNoise = 300, kOnNetwork = 2900;
  constexpr std::size_t kMasters = 3;
  std::array<Found, kServers + kMasters> found;
  std::atomic<bool> over{};
  std::uint64_t damaged = 0;
  std::jthread vandal{[&] {
    std::mt19937_64 random{20261125};
    for (; !over; ++damaged) {
      Context bad{modbus_new_tcp("127.0.0.1", port_)};
      if (modbus_connect(bad.get()) != 0) continue;
      const int socket = modbus_get_socket(bad.get());
      put(socket, random() % 2 == 0 ? noise(random, 600) : cutRequest(random));
      std::this_thread::sleep_for(500us);
    }
  }};
  {
    std::vector<std::jthread> masters;
    masters.emplace_back([&] { found[0] = readAll(onLine(0).get(), kOnLine); });
    masters.emplace_back([&] {
      const auto master = onLine(1);
      std::mt19937_64 random{7};
      found[1] = readAll(master.get(), kAmidNoise, [&] {
        if (random() % 8 != 0) return;
        put(modbus_get_socket(master.get()), random() % 2 == 0 ? noise(random, 200) : cutRequest(random));
        // The silence that ends a damaged frame; else the request comes right behind it.
        if (random() % 2 == 0) std::this_thread::sleep_for(60ms);
      });
    });
    for (std::size_t k = 0; k < kMasters; ++k)
      masters.emplace_back([&, k] { found.at(2 + k) = readAll(onNetwork().get(), kOnNetwork); });
  }
  over = true;
  vandal.join();

  std::uint64_t answers = 0;
  for (const auto& each : found) {
    EXPECT_FALSE(each.torn) << *each.torn;
    answers += each.answers;
  }
  EXPECT_GE(answers, 10'000U);
  for (std::size_t k = 0; k < 2 + kMasters; ++k)
    EXPECT_GT(found.at(k).different, 100U) << k << ": it was written meanwhile";
  EXPECT_GT(damaged, 100U);
  EXPECT_GT(servers_[1]->counters().bad_frames, 10U);
  EXPECT_GT(servers_[2]->counters().bad_frames, 100U);
}

}  // namespace
}  // namespace probebox::app
