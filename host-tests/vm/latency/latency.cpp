#include "latency.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <gtest/gtest.h>
#include <optional>
#include <random>
#include <thread>

#include "box_user.hpp"
#include "drivers/gpio/linux_gpio.hpp"
#include "host-tests/host/test_host.hpp"
#include "protocol/codec/block.hpp"
#include "pulse_train.hpp"
#include "tools/link/wait.hpp"

namespace probebox::vm {
namespace {

using namespace std::chrono_literals;

constexpr std::int64_t kTriggerCame = 2;  // of the channel flags

// When each sample came, and when it was; and which times no sample came of.
struct Arrivals : support::Balances {
  struct Flagged {
    MonoTime at, came;
  };
  struct Missing {
    MonoTime from, to;
    bool holds(MonoTime time) const { return from < time && time <= to; }
  };

  void onBlock(const link::DecodedBlock& block) override {
    const auto now = link::now();
    Balances::onBlock(block);
    const auto first = block.header.first;
    if (next && *next != first.index) missing.push_back({last, codec::timeOf(block.header, first)});
    const auto& channels = block.descriptor.channels;
    const auto flags = std::find_if(channels.begin(), channels.end(), [](auto& c) { return c.name == "flags"; });
    const auto column = block.column(static_cast<std::size_t>(flags - channels.begin()));
    for (std::size_t k = 0; k < column.size(); ++k) {
      last = codec::timeOf(block.header, SampleIndex{first.index + static_cast<std::int64_t>(k)});
      ticks.add(now - last);
      if ((column[k] & kTriggerCame) != 0) triggers.push_back({last, now});
    }
    next = first.index + static_cast<std::int64_t>(column.size());
  }
  Latencies ticks;
  std::vector<Flagged> triggers;
  std::vector<Missing> missing;
  std::optional<std::int64_t> next;
  MonoTime last{};
};

// The sample that tells of an edge, or nothing where the samples after it were lost, which the ledger counted.
std::optional<Nanoseconds> edgeToItsSample(const Arrivals& arrivals, MonoTime made) {
  const auto& all = arrivals.triggers;
  const auto after = [](MonoTime time, const Arrivals::Flagged& flagged) { return time < flagged.at; };
  const auto told = std::upper_bound(all.begin(), all.end(), made, after);
  if (told != all.end() && told->at - made < 20ms) return told->came - made;
  const auto lost =
      std::any_of(arrivals.missing.begin(), arrivals.missing.end(), [&](auto& m) { return m.holds(made); });
  EXPECT_TRUE(lost) << "no sample tells of the edge at " << toNs(made) << " ns, and none is missing";
  return {};
}

}  // namespace

double Latencies::us(double quantile) const {
  if (all_.empty()) return 0;
  auto sorted = all_;
  std::sort(sorted.begin(), sorted.end());
  const auto last = static_cast<double>(sorted.size() - 1);
  return static_cast<double>(sorted[static_cast<std::size_t>(std::ceil(quantile * last))].count()) * 1e-3;
}

void Latencies::print(const std::string& what) const {
  std::printf("%-52s p50 %9.1f  p99 %9.1f  max %9.1f  guest us, %zu times\n", what.c_str(), us(0.5), us(0.99), us(1),
              count());
}

Latencies edgeToStamp(GpioSim& chip, unsigned line, std::size_t edges) {
  gpio::LinuxGpio source{
      {chip.label(), {{"edge", line, {0, LineRole::skip, 0, board::ActiveLevel::high, gpio::Edges::both}}}}};
  Latencies latencies;
  std::array<Event, 16> events{};
  {
    const AsBoxUser user;
    const auto acquired = source.acquire();
    EXPECT_TRUE(acquired) << acquired.error().what;
    if (!acquired) return latencies;
  }
  source.read(events, link::now());
  for (std::size_t i = 0; i < edges; ++i) {
    const auto made = link::now();
    chip.drive(line, i % 2 == 0);
    const auto count = source.read(events, link::now());
    EXPECT_EQ(count, 1U);
    latencies.add(stampOf(events[0]) - made);
  }
  return latencies;
}

BoxLatencies edgeToSample(const std::string& uri, GpioSim& chip, unsigned sync, unsigned trigger, std::size_t edges) {
  Arrivals arrivals;
  const auto host = support::TestHost::connect(uri, &arrivals);
  if (!host) return {};
  PulseTrain train{chip, sync, 1ms};
  EXPECT_TRUE(host->waitForLock());
  host->client().start({});
  EXPECT_TRUE(host->eventually([&] { return arrivals.samples > 500; }));

  std::vector<MonoTime> made;
  std::atomic<bool> done{};
  std::thread hand{[&] {
    // In no step with the box's own rounds.
    std::mt19937_64 random{7};
    for (std::size_t i = 0; i < edges; ++i) {
      std::this_thread::sleep_for(20ms + std::chrono::microseconds{random() % 17'000});
      made.push_back(link::now());
      chip.pulse(trigger);
    }
    done = true;
  }};
  EXPECT_TRUE(host->eventually([&] { return done && arrivals.last - made.back() > 20ms; }));
  hand.join();
  train.stop();
  const auto closing = host->finish();
  EXPECT_TRUE(closing.exact);

  BoxLatencies latencies;
  latencies.tick_to_sample = arrivals.ticks;
  for (const auto edge : made) {
    if (const auto latency = edgeToItsSample(arrivals, edge)) latencies.trigger_to_sample.add(*latency);
  }
  EXPECT_EQ(latencies.trigger_to_sample.count(), arrivals.triggers.size()) << "samples tell of edges that nobody made";
  return latencies;
}

void report(const BoxLatencies& latencies, const std::string& by, std::size_t edges) {
  latencies.trigger_to_sample.print("trigger edge to the sample that tells of it, by " + by);
  latencies.tick_to_sample.print("tick to its sample, by " + by);
  EXPECT_GT(latencies.trigger_to_sample.count(), edges / 2);
  EXPECT_GT(latencies.tick_to_sample.count(), 10'000U);
  for (const auto* each : {&latencies.trigger_to_sample, &latencies.tick_to_sample}) {
    EXPECT_GT(each->us(0.5), 100);
    EXPECT_LT(each->us(0.5), 60'000);
    EXPECT_LT(each->us(0.99), 150'000);
  }
}

}  // namespace probebox::vm
