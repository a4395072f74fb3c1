#include <atomic>
#include <chrono>
#include <cstdio>
#include <thread>

#include "drivers/tcp/emulator.hpp"
#include "tools/tour/tour.hpp"

namespace probebox::tour {
namespace {

using namespace std::chrono_literals;

// A bad wire on a thread of its own.
class BadWire {
 public:
  BadWire(tcp::EmulatedWire wire, std::uint64_t seed) : wire_{std::move(wire)} {
    wire_.disturb({.seed = seed, .corrupt_probability = 2e-6, .drop_probability = 2e-6}, {});
    thread_ = std::thread{[this] { run(); }};
  }
  ~BadWire() { stop(); }
  BadWire(const BadWire&) = delete;
  BadWire& operator=(const BadWire&) = delete;

  void stop() {
    stopping_ = true;
    if (thread_.joinable()) thread_.join();
  }
  // After stop().
  const tcp::WireCounts& counts() const { return wire_.towardsHost(); }

 private:
  void run() {
    while (!stopping_) wire_.pump(10ms);
  }

  tcp::EmulatedWire wire_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

struct Heartbeats : link::StreamListener {
  std::uint64_t seen{};
  std::uint64_t exact{};
  messages::Heartbeat last;
  void onHeartbeat(const messages::Heartbeat& beat, const std::optional<link::Balance>& balance) override {
    last = beat;
    if (!balance) return;
    ++seen;
    if (balance->exact) ++exact;
  }
};

void printLedger(const link::Account& account, std::uint64_t produced) {
  std::printf(
      "   produced %llu = received %llu + lost, declared by the box %llu + lost on the wire, inferred %llu\n",
      static_cast<unsigned long long>(produced), static_cast<unsigned long long>(account.received + account.unreadable),
      static_cast<unsigned long long>(account.declared_lost), static_cast<unsigned long long>(account.inferred_lost));
  std::fflush(stdout);
}

}  // namespace

Stopped showStream(Stage& stage, std::uint64_t seed) {
  constexpr int kSeconds = 10;
  std::puts("\n4. Ten seconds of samples over a wire that spoils and eats bytes, from sensors that drop readings.");
  TRY(auto wire, tcp::EmulatedWire::open({.host = "127.0.0.1", .port = 0}, stage.box));
  const tcp::Address address = wire.address();
  BadWire bad_wire{std::move(wire), seed};
  Heartbeats heartbeats;
  TRY(auto client, meet(address, &heartbeats));
  client->start({});
  for (int second = 0; second < kSeconds; ++second) {
    if (!linger(*client, 1s)) return Error{"The link was lost: " + client->failure()->what};
    const auto& balance = client->reader().ledger().balance();
    if (balance) printLedger(balance->account, balance->produced);
  }
  const auto closing = client->finish(link::patience(5s));
  if (!closing) return Error{closing.error().what};
  bad_wire.stop();
  std::printf("   the wire spoiled %llu and ate %llu of %llu bytes; the sums agreed at %llu of %llu heartbeats\n",
              static_cast<unsigned long long>(bad_wire.counts().corrupted),
              static_cast<unsigned long long>(bad_wire.counts().dropped),
              static_cast<unsigned long long>(bad_wire.counts().carried),
              static_cast<unsigned long long>(heartbeats.exact), static_cast<unsigned long long>(heartbeats.seen));
  const auto& account = closing->account;
  stage.table.exact("samples accounted for",
                    std::to_string(closing->produced) + " = " + std::to_string(account.received + account.unreadable) +
                        " + " + std::to_string(account.declared_lost + account.inferred_lost) + " lost",
                    closing->exact && account.total() == closing->produced && heartbeats.exact == heartbeats.seen &&
                        account.received > 0);
  return {};
}

}  // namespace probebox::tour
