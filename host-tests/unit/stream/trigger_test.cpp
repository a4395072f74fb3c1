#include <gtest/gtest.h>
#include <rapidcheck.h>

#include "box.hpp"

// Triggers to every host that asked for them: each number is received, declared lost or inferred, exactly once.
namespace probebox::stream {
namespace {

using namespace std::chrono_literals;

messages::Trigger trigger(std::uint32_t number) {
  return {.number = number, .line = 1, .at = monoTime(1000 + number), .position_mm = {1.0 * number, 2, 3}};
}

// Writes down what it hears, and whether the account agrees at every heartbeat.
struct TriggerHost : link::StreamListener {
  void read(const std::vector<std::byte>& bytes) { reader.read(bytes); }
  void onTrigger(const messages::Trigger& heard) override {
    wrong += heard.position_mm[0] != 1.0 * heard.number || heard.number < next;
    next = heard.number + 1;
    ++received;
  }
  void onTriggerGap(const messages::TriggerGap& gap) override {
    gaps.push_back(gap);
    next = gap.first + gap.count;
    declared += gap.count;
  }
  void onTriggerHole(const messages::TriggerGap& hole) override { inferred += hole.count; }
  void onHeartbeat(const messages::Heartbeat& newest, const std::optional<link::Balance>&) override {
    beat = newest;
    inexact += !reader.triggers().exact();
  }

  link::StreamReader reader{*this};
  messages::Heartbeat beat;
  std::vector<messages::TriggerGap> gaps;
  std::uint32_t next{};
  std::uint64_t received{}, declared{}, inferred{}, wrong{}, inexact{};
};

void begin(Box& box, TriggerHost& host, std::uint32_t from = 0, bool wanted = true) {
  box.hear(messages::Hello::current(bootId()));
  host.read(box.take());
  messages::Start start;
  start.triggers = wanted;
  start.triggers_from = from;
  box.hear(start);
  host.read(box.take());
}

TEST(Triggers, GoOnlyToThoseWhoAskedForThem) {
  Box box;
  TriggerHost host;
  begin(box, host, 0, false);
  box.push(trigger(1));
  beat(box, host);
  EXPECT_EQ(host.received, 0U);
  EXPECT_EQ(host.beat.first_trigger, 0U);
}

TEST(Triggers, BeginWithTheNextOneUnlessAHostSaysWhatItHas) {
  Box box;
  for (std::uint32_t k = 1; k <= 5; ++k) box.push(trigger(k));
  TriggerHost fresh, resumed;
  begin(box, fresh);
  EXPECT_EQ(fresh.received, 0U);
  EXPECT_EQ(fresh.beat.first_trigger, 6U);
  begin(box, resumed, 3);
  EXPECT_EQ(resumed.received, 3U);
  EXPECT_EQ(resumed.next, 6U);
}

TEST(Triggers, NeedNoCreditAndGoAheadOfSamples) {
  Box box;
  TriggerHost host;
  box.hear(messages::Hello::current(bootId()));
  messages::Start start;
  start.triggers = true;
  start.credit_bytes = 0;
  box.hear(start);
  host.read(box.take());
  box.produce(30);
  box.push(trigger(1));
  host.read(box.take());
  EXPECT_EQ(host.received, 1U);
}

TEST(Triggers, ThatTheBoxLeftOutOrForgotAreDeclared) {
  Box box;
  TriggerHost host;
  begin(box, host);
  box.push(trigger(1));
  box.push(trigger(4));
  beat(box, host);
  ASSERT_EQ(host.gaps.size(), 1U);
  EXPECT_EQ(host.gaps[0].first, 2U);
  EXPECT_EQ(host.gaps[0].count, 2U);
  EXPECT_EQ(host.gaps[0].reason, GapReason::queue_full);
  const auto many = static_cast<std::uint32_t>(TriggerHistory::kKept);
  for (std::uint32_t k = 5; k < 5 + 2 * many; ++k) box.push(trigger(k));
  beat(box, host);
  EXPECT_EQ(host.gaps.back().reason, GapReason::ring_overrun);
  EXPECT_EQ(host.gaps.back().count, many);
  EXPECT_EQ(host.received + host.declared, 4U + 2 * many);
  TriggerHost late;
  begin(box, late, 2);
  EXPECT_EQ(late.gaps.at(0).reason, GapReason::resume_too_old);
  EXPECT_EQ(late.received, many);
  EXPECT_EQ(host.inexact + late.inexact, 0U);
}

TEST(Triggers, ThatWereTheNewestAreDeclaredAsSoonAsTheBoxKnows) {
  Box box;
  TriggerHost host;
  begin(box, host);
  box.push(trigger(1));
  box.reachTrigger(2);
  beat(box, host);
  EXPECT_TRUE(host.gaps.empty());
  box.reachTrigger(4);
  beat(box, host);
  ASSERT_EQ(host.gaps.size(), 1U);
  EXPECT_EQ(host.gaps[0].first, 2U);
  EXPECT_EQ(host.gaps[0].count, 2U);
  box.push(trigger(4));
  beat(box, host);
  EXPECT_EQ(host.received, 2U);
  EXPECT_EQ(host.beat.lost_triggers, 2U);
  EXPECT_EQ(host.inexact, 0U);
}

// As in a replay: nobody knows the numbers of a recording before they come, and those before it are not lost.
TEST(Triggers, WhoseNumbersNobodyKnowsBeginWithTheFirst) {
  TriggerHistory history{8, 0};
  TriggerFeed feed{history};
  feed.start(0);
  EXPECT_FALSE(feed.due());
  EXPECT_EQ(feed.ledger().first, 0U);
  history.reach(35);  // a recorded loss of two
  history.reach(37);
  history.push(trigger(37));
  ASSERT_TRUE(feed.due());
  EXPECT_EQ(feed.next().loss.count, 2U);
  feed.take(feed.next());
  ASSERT_NE(feed.next().trigger, nullptr);
  feed.take(feed.next());
  EXPECT_FALSE(feed.due());
  const auto& [first, next, sent, lost] = feed.ledger();
  EXPECT_EQ(first, 35U);
  EXPECT_EQ(next, 38U);
  EXPECT_EQ(sent, 1U);
  EXPECT_EQ(lost, 2U);
}

TEST(Triggers, BalanceAtEveryHeartbeatOnABadWire) {
  EXPECT_TRUE(rc::check("received + declared + inferred == produced", [] {
    Box box;
    TriggerHost host;
    begin(box, host);
    std::uint32_t number = 0;
    for (int k = 0; k < 60; ++k) {
      for (int burst = *rc::gen::inRange(0, 4); burst > 0; --burst) {
        number += *rc::gen::weightedElement<std::uint32_t>({{9, 1}, {1, 3}});
        box.push(trigger(number));
      }
      if (*rc::gen::arbitrary<bool>()) box.produce(20);
      box.hear(messages::Credit{0});
      box.advance(40ms);
      auto bytes = box.take(*rc::gen::inRange<std::size_t>(0, 2000));
      if (!bytes.empty() && *rc::gen::inRange(0, 3) == 0)
        bytes[*rc::gen::inRange<std::size_t>(0, bytes.size())] ^= std::byte{0x41};
      host.read(bytes);
    }
    for (int k = 0; k < 11; ++k) beat(box, host);  // one of them stands by itself
    RC_ASSERT(host.wrong == 0U);
    RC_ASSERT(host.inexact == 0U);
    RC_ASSERT(host.received + host.declared + host.inferred == number);
    RC_ASSERT(host.beat.sent_triggers + host.beat.lost_triggers == number);
  }));
}

}  // namespace
}  // namespace probebox::stream
