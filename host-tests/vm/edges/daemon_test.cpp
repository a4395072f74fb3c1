#include <algorithm>
#include <atomic>
#include <fstream>
#include <gmock/gmock.h>
#include <map>
#include <vector>

#include "box_on_lines.hpp"
#include "protocol/codec/block.hpp"
#include "tools/link/wait.hpp"

// The whole box on edges that the kernel stamped.
namespace probebox::vm {
namespace {

using namespace std::chrono_literals;

class BoxOnAChip : public BoxOnLines {
 protected:
  void SetUp() override {
    start();
    ASSERT_TRUE(host->eventually([&] { return allIsWell(); })) << box.log();
  }
  // Every edge of the line that was made since the box had the line is accounted for.
  void expectExactly(const std::string& name, std::uint64_t made, std::uint64_t lost) {
    EXPECT_TRUE(host->eventually([&] {
      const auto now = line(name);
      return now.edges + now.lost >= made;
    })) << name;
    const auto end = line(name);
    EXPECT_EQ(end.edges + end.lost, made) << name;
    EXPECT_EQ(end.lost, lost) << name;
  }

  std::unique_ptr<GpioSim> chip{plugged()};
};

TEST_F(BoxOnAChip, LocksItsClockOnTheSyncLineAndStreamsSamplesThatAreAllAccountedFor) {
  support::Balances balances;
  host.reset();
  host = connect(&balances);
  PulseTrain sync{*chip, kSync, kTick};
  ASSERT_TRUE(host->waitForLock()) << box.log();
  host->client().start({});
  ASSERT_TRUE(host->eventually([&] { return balances.samples >= 4000; }));
  const auto closing = host->finish();
  sync.stop();
  EXPECT_TRUE(closing.exact);
  EXPECT_EQ(closing.account.total(), closing.produced);
  EXPECT_EQ(closing.account.received, closing.produced) << "nothing was lost on the way";
  EXPECT_GT(balances.heartbeats, 10);
  EXPECT_EQ(balances.exact, balances.heartbeats);

  expectExactly("sync", sync.made(), 0);
  const auto clock = status().clock;
  EXPECT_EQ(clock.edges.lost, 0U);
  // The train and the box have the same clock; what is left is the learning, and the scatter of the stamps.
  EXPECT_LT(std::abs(clock.frequency_ppb), 100'000);
  EXPECT_LT(clock.sigma_ns, 50'000U);
}

// Bits of the channel flags.
constexpr std::int64_t kTrigger = 2;
constexpr std::int64_t kInContact = 4;
constexpr std::int64_t kSkipped = 8;
constexpr std::int64_t kIndexPulse = 64;

// Every sample's time, by the block's own map, and its flags.
struct Flags : support::Balances {
  struct Sample {
    MonoTime at{};
    std::int64_t flags{};
  };
  void onBlock(const link::DecodedBlock& block) override {
    Balances::onBlock(block);
    const auto& channels = block.descriptor.channels;
    const auto flags = std::find_if(channels.begin(), channels.end(), [](auto& c) { return c.name == "flags"; });
    const auto column = block.column(static_cast<std::size_t>(flags - channels.begin()));
    for (std::size_t k = 0; k < column.size(); ++k) {
      const SampleIndex sample{block.header.first.index + static_cast<std::int64_t>(k)};
      all.push_back({codec::timeOf(block.header, sample), column[k]});
    }
  }
  bool any(std::int64_t bit) const {
    return std::any_of(all.begin(), all.end(), [=](const auto& sample) { return (sample.flags & bit) != 0; });
  }
  std::vector<Sample> all;
};

// An edge is stamped between these; as long before and after it, a sample may be on either side, because the clock's
// estimate moves by microseconds.
struct Moment {
  MonoTime before{};
  MonoTime after{};
};
constexpr Nanoseconds kEither = 20us;

void expectSetBetween(const Moment& from, const Moment& to, std::int64_t bit, const Flags& flags) {
  int set = 0;
  for (const auto& [at, bits] : flags.all) {
    const bool is_clear = at < from.before - kEither || at > to.after + kEither;
    const bool is_set = at > from.after + kEither && at < to.before - kEither;
    if (is_clear || is_set) {
      EXPECT_EQ(bits & bit, is_set ? bit : 0) << toNs(at) << ", " << toNs(from.before) << " to " << toNs(to.after);
    }
    set += (bits & bit) != 0 ? 1 : 0;
  }
  EXPECT_GT(set, 2);
}

// In one sample only: the first one after the moment.
void expectSetOnceAfter(const Moment& moment, std::int64_t bit, const Flags& flags) {
  int times = 0;
  for (std::size_t i = 1; i < flags.all.size(); ++i) {
    if ((flags.all[i].flags & bit) == 0) continue;
    ++times;
    EXPECT_GT(flags.all[i].at, moment.before - kEither);
    EXPECT_LT(flags.all[i - 1].at, moment.after + kEither);
  }
  EXPECT_EQ(times, 1);
}

TEST_F(BoxOnAChip, PutsTouchSkipAndIndexIntoTheSamplesOfTheirTime) {
  Flags flags;
  host.reset();
  host = connect(&flags);
  PulseTrain sync{*chip, kSync, kTick};
  ASSERT_TRUE(host->waitForLock()) << box.log();
  host->client().start({});
  ASSERT_TRUE(host->eventually([&] { return flags.samples > 500; }));
  const auto drive = [&](unsigned line, bool high) {
    Moment moment{link::now(), {}};
    chip->drive(line, high);
    moment.after = link::now();
    host->linger(7ms);
    return moment;
  };
  const auto touch = drive(kTouch, true);
  const auto release = drive(kTouch, false);
  const auto skip = drive(kSkip, false);
  const auto go_on = drive(kSkip, true);
  const auto index = drive(kIndexX, true);
  ASSERT_TRUE(host->eventually([&] { return flags.any(kIndexPulse); }));
  host->finish();
  sync.stop();

  expectSetBetween(touch, release, kInContact, flags);
  expectSetOnceAfter(touch, kTrigger, flags);
  expectSetBetween(skip, go_on, kSkipped, flags);
  expectSetOnceAfter(index, kIndexPulse, flags);
  expectExactly("touch", 2, 0);
  expectExactly("overtravel", 0, 0);
  expectExactly("index X", 1, 0);
  expectExactly("skip", 2, 0);
  expectExactly("sync", sync.made(), 0);
}

TEST_F(BoxOnAChip, CountsEveryEdgeThatFellOutOfTheKernelsBuffer) {
  constexpr std::uint64_t kBuffer = 1024;
  {
    PulseTrain sync{*chip, kSync, kTick};
    ASSERT_TRUE(host->waitForLock());
    sync.stop();
    const auto before = sync.made();
    expectExactly("sync", before, 0);
    for (int time = 1; time <= 3; ++time) {
      SCOPED_TRACE(time);
      box.freeze();
      for (std::uint64_t i = 0; i < kBuffer + 300; ++i) {
        chip->pulse(kSync);
        chip->pulse(kTouch);
      }
      box.thaw();
      const auto times = static_cast<std::uint64_t>(time);
      expectExactly("sync", before + times * (kBuffer + 300), times * 300);
      expectExactly("touch", times * 2 * (kBuffer + 300), times * (kBuffer + 600));
    }
  }
  const auto events = status().events;
  EXPECT_EQ(events.lost, 3U * (300 + kBuffer + 600));
  EXPECT_EQ(events.lost_in_queue, 0U);
}

TEST_F(BoxOnAChip, LosesNoEdgeAtThreeThousandASecondOnAllLines) {
  support::Balances balances;
  host.reset();
  host = connect(&balances);
  std::uint64_t touches = 0;
  std::atomic<bool> touching{};
  // Beside 1000 ticks a second 2000 edges of the probe's line.
  PulseTrain sync{*chip, kSync, kTick, [&](std::uint64_t) {
                    if (!touching) return;
                    chip->pulse(kTouch);
                    touches += 2;
                  }};
  ASSERT_TRUE(host->waitForLock());
  host->client().start({});
  touching = true;
  ASSERT_TRUE(host->eventually([&] { return balances.samples >= 10'000; }));
  touching = false;
  const auto closing = host->finish();
  sync.stop();
  EXPECT_TRUE(closing.exact);
  EXPECT_EQ(balances.exact, balances.heartbeats);
  EXPECT_GE(touches, 9'900U);
  expectExactly("sync", sync.made(), 0);
  expectExactly("touch", touches, 0);
  EXPECT_EQ(status().events.lost, 0U);
  EXPECT_EQ(status().clock.edges.lost, 0U);
}

TEST_F(BoxOnAChip, RunsWithoutAnyPrivilege) {
  std::ifstream file{"/proc/" + std::to_string(box.pid()) + "/status"};
  std::map<std::string, std::string> status;
  for (std::string line; std::getline(file, line);) {
    const auto colon = line.find(":\t");
    if (colon != std::string::npos) status[line.substr(0, colon)] = line.substr(colon + 2);
  }
  EXPECT_EQ(status["Uid"], "7627\t7627\t7627\t7627");
  EXPECT_EQ(status["Gid"], "7627\t7627\t7627\t7627");
  for (const char* set : {"CapInh", "CapPrm", "CapEff", "CapBnd", "CapAmb"}) EXPECT_EQ(status[set], "0000000000000000");
  EXPECT_EQ(status["NoNewPrivs"], "1");
}

}  // namespace
}  // namespace probebox::vm
