#include "tools/fleet/queue/outbox.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <vector>

#include "host-tests/support/temporary_folder.hpp"

namespace probebox::fleet {
namespace {

namespace fs = std::filesystem;

class AnOutbox : public testing::Test {
 protected:
  std::string path() const { return (folder_.path() / "SIM-0001").string(); }
  // As the publisher does it: an entry is announced before its messages are sent.
  static void send(Outbox& outbox, std::uint64_t number, std::set<int> messages) {
    ASSERT_FALSE(outbox.announce(number));
    outbox.begin({number, std::to_string(number) + " 2026-11-26T08:15:00Z"}, std::move(messages));
  }

  support::TemporaryFolder folder_{support::inMemory()};
};

TEST_F(AnOutbox, BeginsWithTheFirstEntryUnmarked) {
  const auto outbox = Outbox::open(path());
  EXPECT_EQ(outbox.last(), 0U);
  EXPECT_EQ(outbox.acknowledged().number, 0U);
  EXPECT_FALSE(outbox.mayHaveBeenSent(1));
}

TEST_F(AnOutbox, GoesOnBehindWhatIsAcknowledged) {
  {
    auto outbox = Outbox::open(path());
    send(outbox, 1, {11, 12});
    outbox.acknowledge(11);
    EXPECT_EQ(outbox.acknowledged().number, 0U);
    outbox.acknowledge(12);
    EXPECT_EQ(outbox.acknowledged().number, 1U);
    ASSERT_FALSE(outbox.store());
  }
  const auto outbox = Outbox::open(path());
  EXPECT_EQ(outbox.last(), 1U);
  EXPECT_EQ(outbox.acknowledged().identity, "1 2026-11-26T08:15:00Z");
  EXPECT_FALSE(outbox.mayHaveBeenSent(2));
}

TEST_F(AnOutbox, MarksWhatWasSentBeforeACrash) {
  {
    auto outbox = Outbox::open(path());
    send(outbox, 1, {1});
    outbox.acknowledge(1);
    ASSERT_FALSE(outbox.store());
    send(outbox, 2, {2});
    send(outbox, 3, {3});
    outbox.acknowledge(2);  // the process ends before this is on the disk
  }
  const auto outbox = Outbox::open(path());
  EXPECT_EQ(outbox.last(), 1U);
  EXPECT_TRUE(outbox.mayHaveBeenSent(2));
  EXPECT_TRUE(outbox.mayHaveBeenSent(3));
  EXPECT_FALSE(outbox.mayHaveBeenSent(4));
}

TEST_F(AnOutbox, CountsNothingAsSentThatWasNotAnnounced) {
  auto outbox = Outbox::open(path());
  fs::remove_all(folder_.path());
  std::ofstream{folder_.path()} << "no folder any more";
  EXPECT_TRUE(outbox.announce(1));
}

TEST_F(AnOutbox, TakesAcknowledgementsInAnyOrder) {
  auto outbox = Outbox::open(path());
  for (int n = 1; n <= 3; ++n) send(outbox, static_cast<std::uint64_t>(n), {n});
  outbox.acknowledge(3);
  outbox.acknowledge(99);
  EXPECT_EQ(outbox.acknowledged().number, 0U);
  EXPECT_EQ(outbox.inFlight(), 2U);
  outbox.acknowledge(1);
  EXPECT_EQ(outbox.acknowledged().number, 1U);
  outbox.acknowledge(2);
  EXPECT_EQ(outbox.acknowledged().number, 3U);
  EXPECT_EQ(outbox.inFlight(), 0U);
}

TEST_F(AnOutbox, HasRoomForTwentyMessages) {
  auto outbox = Outbox::open(path());
  for (int n = 0; n < 9; ++n) send(outbox, static_cast<std::uint64_t>(n + 1), {2 * n, 2 * n + 1});
  EXPECT_TRUE(outbox.hasRoomFor(2));
  send(outbox, 10, {18, 19});
  EXPECT_FALSE(outbox.hasRoomFor(1));
}

TEST_F(AnOutbox, SendsEverythingAgainAndMarkedAfterADamage) {
  {
    auto outbox = Outbox::open(path());
    send(outbox, 7, {1});
    outbox.acknowledge(1);
    ASSERT_FALSE(outbox.store());
  }
  fs::resize_file(path(), 0);
  std::ofstream{path()} << std::string(8192, 'x');
  {
    auto outbox = Outbox::open(path());
    EXPECT_FALSE(outbox.notice().empty());
    EXPECT_EQ(outbox.last(), 0U);
    EXPECT_TRUE(outbox.mayHaveBeenSent(7));
    send(outbox, 1, {1});
  }
  // It stays so over a crash in between, until all has been acknowledged.
  auto outbox = Outbox::open(path());
  EXPECT_TRUE(outbox.mayHaveBeenSent(7));
  for (int n = 1; n <= 7; ++n) {
    send(outbox, static_cast<std::uint64_t>(n), {n});
    outbox.acknowledge(n);
  }
  outbox.caughtUp();
  EXPECT_FALSE(outbox.mayHaveBeenSent(8));
  ASSERT_FALSE(outbox.store());
  EXPECT_FALSE(Outbox::open(path()).mayHaveBeenSent(8));
}

TEST_F(AnOutbox, StartsOverWhereTheBoxHasAnotherHistory) {
  auto outbox = Outbox::open(path());
  send(outbox, 5, {1});
  outbox.acknowledge(1);
  outbox.startOver();
  EXPECT_EQ(outbox.last(), 0U);
  EXPECT_FALSE(outbox.mayHaveBeenSent(1));
  ASSERT_FALSE(outbox.store());
  EXPECT_EQ(Outbox::open(path()).last(), 0U);
}

// Whatever is acknowledged, stored or lost by a crash: no entry is left out, and what comes twice is marked.
TEST_F(AnOutbox, LosesNothingAndMarksWhatComesTwice) {
  static constexpr std::uint64_t kEntries = 12;
  static constexpr int kStarts = 6;
  rc::check([this] {
    fs::remove(path());
    std::vector<int> arrivals(kEntries + 1);
    int message = 0;
    for (int start = 1; start <= kStarts; ++start) {
      auto outbox = Outbox::open(path());
      std::vector<int> sent;
      const auto send_next = [&] {
        const auto next = outbox.last() + 1;
        if (next > kEntries || !outbox.hasRoomFor(1)) return;
        RC_ASSERT(!outbox.announce(std::min(next + 2, kEntries)));
        RC_ASSERT(arrivals[next] == 0 || outbox.mayHaveBeenSent(next));
        ++arrivals[next];
        outbox.begin({next, "x"}, {++message});
        sent.push_back(message);
      };
      // Only the last start is not interrupted.
      const auto steps = *rc::gen::container<std::vector<int>>(20, rc::gen::inRange(0, 4));
      for (const int step : steps) {
        if (step == 0) send_next();
        if (step == 1 && !sent.empty()) outbox.acknowledge(sent.back()), sent.pop_back();
        if (step == 2 && !sent.empty()) outbox.acknowledge(sent.front()), sent.erase(sent.begin());
        if (step == 3) RC_ASSERT(!outbox.store());
      }
      while (start == kStarts && outbox.last() < kEntries) send_next();
    }
    for (std::uint64_t n = 1; n <= kEntries; ++n) RC_ASSERT(arrivals[n] >= 1);
  });
}

}  // namespace
}  // namespace probebox::fleet
