#include <gtest/gtest.h>
#include <vector>

#include "box.hpp"

// Profile tight on a link: each block needs the one before, and the box can send a key block at any time.
namespace probebox::stream {
namespace {

using messages::Profile;

const messages::Start kTight{.profile = Profile::tight};

// How the blocks that the host has heard are coded, by the first byte of each.
std::vector<int> codings(const Host& host) {
  std::vector<int> all;
  for (const auto byte : host.codings) all.push_back(std::to_integer<int>(byte));
  return all;
}

TEST(Tight, BeginsWithAKeyAndGoesOnWithoutOne) {
  Box box;
  Host host;
  begin(box, host, kTight);
  for (int k = 0; k < 4; ++k) box.produce(50);
  host.read(box.take());
  EXPECT_EQ(codings(host), (std::vector{2, 3, 3, 3}));
  EXPECT_EQ(host.received, 200U);
  EXPECT_EQ(host.wrong_values, 0U);
}

TEST(Tight, CountsWhatCannotBeDecodedAsLostUntilAKeyComesForTheAsking) {
  Box box;
  Host host;
  begin(box, host, kTight);
  box.produce(50);
  host.read(box.take());
  box.produce(50);
  box.take();  // lost on the wire
  for (int k = 0; k < 3; ++k) box.produce(50);
  host.read(box.take());
  EXPECT_EQ(host.received, 50U);
  EXPECT_EQ(host.reader.faults().keyless_blocks, 3U);
  box.hear(kTight);  // START again
  box.produce(50);
  host.read(box.take());
  beat(box, host);
  EXPECT_EQ(codings(host), (std::vector{2, 3, 3, 3, 2}));
  EXPECT_EQ(host.received, 100U);
  EXPECT_EQ(host.wrong_values, 0U);
  EXPECT_EQ(host.reader.ledger().account().inferred_lost, 200U);
  EXPECT_EQ(host.reader.ledger().unexplained(), 0U);
  EXPECT_TRUE(host.balances.back()->exact);
  EXPECT_TRUE(host.refusals.empty());
}

TEST(Tight, ChangesToAndFromOtherProfilesWithoutALoss) {
  Box box;
  Host host;
  begin(box, host, kTight);
  std::vector<int> expected;
  for (const auto profile : {Profile::tight, Profile::raw, Profile::tight, Profile::fast, Profile::tight}) {
    box.hear(messages::Start{.profile = profile});
    for (int k = 0; k < 3; ++k) box.produce(40);
    host.read(box.take());
    if (profile == Profile::tight) expected.insert(expected.end(), {2, 3, 3});
    if (profile != Profile::tight) expected.insert(expected.end(), 3, static_cast<int>(profile));
  }
  beat(box, host);
  EXPECT_EQ(codings(host), expected);
  EXPECT_EQ(host.received, 15 * 40U);
  EXPECT_EQ(host.declared, 0U);
  EXPECT_EQ(host.wrong_values, 0U);
  EXPECT_EQ(host.inexact, 0U);
  EXPECT_TRUE(host.contiguous());
}

// Blocks that wait, or are read from the history, are not lost by a change.
TEST(Tight, ChangesWhileTheHostCatchesUp) {
  Box box;
  for (int k = 0; k < 5; ++k) box.produce(40);
  Host host;
  auto start = messages::Start{.profile = Profile::raw, .has_resume = true, .resume_from = {1000}};
  begin(box, host, start);
  host.read(box.take(1500));
  start.profile = Profile::tight;
  box.hear(start);
  box.produce(40);
  host.read(box.take());
  start.profile = Profile::fast;
  box.hear(start);
  box.produce(40);
  host.read(box.take());
  beat(box, host);
  EXPECT_EQ(host.received, 7 * 40U);
  EXPECT_EQ(host.declared, 0U);
  EXPECT_EQ(host.wrong_values, 0U);
  EXPECT_EQ(host.inexact, 0U);
  EXPECT_TRUE(host.contiguous());
}

TEST(Tight, AResumedHostGetsAKeyFirst) {
  Box box;
  Host host;
  begin(box, host, kTight);
  for (int k = 0; k < 3; ++k) box.produce(40);
  box.take();  // the link breaks
  Host again;
  begin(box, again, {.profile = Profile::tight, .has_resume = true, .resume_from = {1040}});
  again.read(box.take());
  EXPECT_EQ(codings(again), (std::vector{2, 3}));
  EXPECT_EQ(again.received, 80U);
  EXPECT_EQ(again.wrong_values, 0U);
}

TEST(Tight, GoesOnBehindALossOfTheBox) {
  Box box;
  Host host;
  begin(box, host, kTight);
  box.produce(40);
  box.lose(17);
  box.produce(40);
  host.read(box.take());
  beat(box, host);
  EXPECT_EQ(codings(host), (std::vector{2, 3}));
  EXPECT_EQ(host.received, 80U);
  EXPECT_EQ(host.declared, 17U);
  EXPECT_EQ(host.wrong_values, 0U);
  EXPECT_EQ(host.inexact, 0U);
}

TEST(Tight, SendsLessThanFast) {
  std::vector<std::uint64_t> bytes;
  for (const auto profile : {Profile::fast, Profile::tight}) {
    Box box;
    Host host;
    begin(box, host, {.profile = profile});
    for (int k = 0; k < 30; ++k) box.produce(200);
    host.read(box.take());
    beat(box, host);
    EXPECT_EQ(host.received, 6000U);
    bytes.push_back(host.beats.back().sent_bytes);
  }
  EXPECT_LT(bytes[1], bytes[0]);
}

TEST(Tight, EncodesNoMoreThanTheThreadAllows) {
  int blocks = 2;
  Box box{{.tight_blocks = &blocks}};
  Host host;
  begin(box, host, kTight);
  for (int k = 0; k < 5; ++k) box.produce(40);
  host.read(box.take());
  EXPECT_EQ(host.received, 80U);
  EXPECT_EQ(blocks, 0);
  blocks = 10;
  beat(box, host);
  EXPECT_EQ(codings(host), (std::vector{2, 3, 3, 3, 3}));
  EXPECT_EQ(host.received, 200U);
  EXPECT_EQ(host.declared, 0U);
  EXPECT_EQ(blocks, 7);
  box.hear(messages::Start{.profile = Profile::fast});
  blocks = 0;
  box.produce(40);
  beat(box, host);
  EXPECT_EQ(host.received, 240U) << "other profiles cost little";
}

TEST(Tight, IsRefusedByNameWhereABoxHasTooManySamplesForIt) {
  Box box;
  auto quick = descriptor();
  quick.samples_per_tick = 100;
  box.describe(quick);
  Host host;
  begin(box, host, kTight);
  host.read(box.take());
  ASSERT_EQ(host.refusals.size(), 1U);
  EXPECT_EQ(host.refusals[0].code, messages::ErrorCode::refused);
  box.hear(messages::Start{.profile = Profile::fast});
  box.produce(10);
  host.read(box.take());
  EXPECT_EQ(host.received, 10U);
}

// A recorder that may begin anywhere gets blocks that each can be decoded without any other.
TEST(Tight, ComesAsFastBlocksToWhoNeedsThatEachStandsAlone) {
  struct Alone : Host {
    bool needsBlocksThatStandAlone() const override { return true; }
    void onFrame(const frame::Frame& frame) override {
      Host::onFrame(frame);
      if (static_cast<messages::MessageType>(frame.header.type) != messages::MessageType::samples) return;
      std::vector<std::int64_t> columns(2 * 50);
      decodable += codec::decode(frame.payload, kFormats, columns).ok();
      ends_with = columns;
    }
    int decodable{};
    std::vector<std::int64_t> ends_with;
  };
  Box box;
  Alone host;
  begin(box, host, kTight);
  for (int k = 0; k < 3; ++k) box.produce(50);
  host.read(box.take());
  EXPECT_EQ(codings(host), (std::vector{1, 1, 1}));
  EXPECT_EQ(host.decodable, 3);
  EXPECT_EQ(host.received, 150U);
  EXPECT_EQ(host.ends_with.front(), 1100);
}

}  // namespace
}  // namespace probebox::stream
