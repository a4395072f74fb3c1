#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "box.hpp"

namespace probebox::stream {
namespace {

using messages::GapReason;
using messages::Policy;

messages::Start resume(std::int64_t from) {
  return {.has_resume = true, .resume_from = {from}};
}

TEST(Policy, LiveKeepsTheNewestAndDeclaresTheOldest) {
  Box box{{.live_bytes = 2000}};
  Host host;
  begin(box, host, {.policy = Policy::live, .credit_bytes = 0});
  for (int k = 0; k < 20; ++k) box.produce(50);
  box.hear(messages::Credit{messages::kUnlimitedCredit});
  host.read(box.take());
  ASSERT_EQ(host.gaps.size(), 1U);
  EXPECT_EQ(host.pieces.front().first, SampleIndex{1000});
  EXPECT_EQ(host.gaps[0].first, SampleIndex{1000});
  EXPECT_EQ(host.gaps[0].reason, GapReason::queue_full);
  EXPECT_EQ(host.gaps[0].count + host.received, 1000U);
  EXPECT_TRUE(host.contiguous());
}

TEST(Policy, RecordKeepsTheOldestAndDeclaresTheNewest) {
  Box box{{.queue_bytes = 2000}};
  Host host;
  begin(box, host, {.policy = Policy::record, .credit_bytes = 0});
  for (int k = 0; k < 20; ++k) box.produce(50);
  box.hear(messages::Credit{messages::kUnlimitedCredit});
  host.read(box.take());
  ASSERT_EQ(host.gaps.size(), 1U);
  EXPECT_EQ(host.gaps[0].first + static_cast<std::int64_t>(host.gaps[0].count), box.next());
  EXPECT_EQ(host.gaps[0].count + host.received, 1000U);
  EXPECT_GT(host.received, 0U);
  EXPECT_TRUE(host.contiguous());
}

TEST(Feed, AJumpOfTheIndexIsALossOfTheClock) {
  Box box;
  Host host;
  begin(box, host);
  const auto first = block({10}, 5);
  const auto later = block({40}, 5);
  box.session.offer(EncodedBlock{{10}, 5, first});
  box.session.offer(EncodedBlock{{40}, 5, later});
  box.session.offer(EncodedBlock{{10}, 5, first});  // never twice
  host.read(box.take());
  ASSERT_EQ(host.gaps.size(), 1U);
  EXPECT_EQ(host.gaps[0].first, SampleIndex{15});
  EXPECT_EQ(host.gaps[0].count, 25U);
  EXPECT_EQ(host.gaps[0].reason, GapReason::source_clock);
  EXPECT_EQ(host.received, 10U);
  EXPECT_EQ(box.session.feed().repeated(), 1U);
}

TEST(Resume, GivesWhatTheHostHasNotSeen) {
  Box box;
  Host host;
  for (int k = 0; k < 10; ++k) box.produce(20);
  box.lose(7);
  box.produce(20);
  begin(box, host, resume(1060));
  host.read(box.take());
  box.produce(20);
  host.read(box.take());
  EXPECT_EQ(host.pieces.front().first, SampleIndex{1060});
  EXPECT_EQ(host.pieces.back().first + static_cast<std::int64_t>(host.pieces.back().count), box.next());
  EXPECT_TRUE(host.contiguous());
  EXPECT_EQ(host.declared, 7U);
  EXPECT_EQ(host.wrong_values, 0U);
}

TEST(Resume, InTheMiddleOfABlockBeginsWithThatBlock) {
  Box box;
  Host host;
  for (int k = 0; k < 10; ++k) box.produce(20);
  begin(box, host, resume(1075));
  host.read(box.take());
  EXPECT_EQ(host.pieces.front().first, SampleIndex{1060});
  EXPECT_EQ(host.inexact, 0U);
}

TEST(Resume, FromBeforeTheHistoryDeclaresWhatIsGone) {
  Box box{{}, 2000};
  Host host;
  for (int k = 0; k < 100; ++k) box.produce(20);
  begin(box, host, resume(1000));
  host.read(box.take());
  ASSERT_EQ(host.gaps.size(), 1U);
  EXPECT_EQ(host.gaps[0].first, SampleIndex{1000});
  EXPECT_EQ(host.gaps[0].reason, GapReason::resume_too_old);
  EXPECT_EQ(host.gaps[0].count + host.received, 2000U);
  EXPECT_TRUE(host.contiguous());
}

TEST(Resume, OvertakenByTheRingDeclaresWhatIsGone) {
  Box box{{}, 2000};
  Host host;
  for (int k = 0; k < 5; ++k) box.produce(20);
  auto start = resume(1000);
  start.credit_bytes = 250;
  begin(box, host, start);
  host.read(box.take());
  ASSERT_EQ(host.received, 20U);
  for (int k = 0; k < 100; ++k) box.produce(20);
  box.hear(messages::Credit{messages::kUnlimitedCredit});
  host.read(box.take());
  ASSERT_EQ(host.gaps.size(), 1U);
  EXPECT_EQ(host.gaps[0].reason, GapReason::ring_overrun);
  EXPECT_TRUE(host.contiguous());
  EXPECT_EQ(host.gaps[0].count + host.received, 2100U);
}

TEST(Resume, OfAnotherBootStartsWithWhatComesNext) {
  Box box;
  Host host;
  box.produce(20);
  box.hear(messages::Hello::current());
  box.hear(resume(1000));
  box.produce(20);
  host.read(box.take());
  EXPECT_EQ(host.pieces.front().first, SampleIndex{1020});
}

TEST(Resume, FromTheFutureIsRefused) {
  Box box;
  Host host;
  box.produce(20);
  begin(box, host, resume(5000));
  host.read(box.take());
  ASSERT_EQ(host.refusals.size(), 1U);
  EXPECT_EQ(host.refusals[0].code, messages::ErrorCode::wrong_state);
}

TEST(Stop, ClosesTheLedger) {
  Box box;
  Host host;
  begin(box, host);
  box.produce(20);
  host.read(box.take());
  box.hear(messages::Stop{});
  host.read(box.take());
  ASSERT_FALSE(host.beats.empty());
  EXPECT_FALSE(host.beats.back().streaming);
  EXPECT_EQ(host.beats.back().produced, 20U);
  EXPECT_TRUE(host.reader.ledger().closed());
  box.produce(20);
  host.read(box.take());
  EXPECT_EQ(host.received, 20U);
}

}  // namespace
}  // namespace probebox::stream
