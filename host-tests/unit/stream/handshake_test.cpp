#include <array>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "box.hpp"

namespace probebox::stream {
namespace {

using namespace std::chrono_literals;
using messages::ErrorCode;
using messages::MessageType;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

TEST(Handshake, GivesWelcomeDescriptorAndTestPattern) {
  Box box;
  Host host;
  box.hear(messages::Hello::current());
  host.read(box.take());
  EXPECT_THAT(host.types, ElementsAre(MessageType::welcome, MessageType::descriptor, MessageType::test_pattern));
  EXPECT_EQ(host.reader.welcome()->firmware_version, "0.1.0");
  EXPECT_EQ(host.reader.welcome()->boot_id, bootId());
  EXPECT_EQ(host.reader.descriptor()->board, "sim");
  EXPECT_TRUE(host.reader.testPatternSeen());
  EXPECT_EQ(box.session.state(), SessionState::greeted);
}

TEST(Handshake, NumbersTheSessionsFromTheFirstOfItsLink) {
  SessionOptions options;
  options.first_session_id = 3001;
  Box box{std::move(options)};
  for (const std::uint32_t id : {3001U, 3002U}) {
    Host host;
    box.hear(messages::Hello::current());
    host.read(box.take());
    ASSERT_TRUE(host.reader.welcome());
    EXPECT_EQ(host.reader.welcome()->session_id, id);
  }
}

TEST(Handshake, PassesOnTheTimeOfDayOnce) {
  Box box;
  box.hear(messages::Hello::current({}, {.utc_us = 1'700'000'000'000'000, .error_ms = 40}));
  const auto told = box.session.nextTimeOfDay();
  ASSERT_TRUE(told);
  EXPECT_EQ(told->utc_us, 1'700'000'000'000'000);
  EXPECT_EQ(told->error_ms, 40U);
  EXPECT_FALSE(box.session.nextTimeOfDay());
  box.hear(messages::Hello::current());
  EXPECT_FALSE(box.session.nextTimeOfDay()) << "of a host that knows none";
}

TEST(Handshake, BeginsWithADelimiterSoThatOldGarbageEnds) {
  Box box;
  Host host;
  host.read(std::vector<std::byte>(50, std::byte{0x5A}));  // of whoever used the line before
  box.hear(messages::Hello::current());
  host.read(box.take());
  EXPECT_TRUE(host.heard(MessageType::welcome));
}

TEST(Handshake, AnotherMajorIsToldSo) {
  Box box;
  Host host;
  auto hello = messages::Hello::current();
  hello.major = 2;
  box.hear(hello, 2);
  host.read(box.take());
  ASSERT_EQ(host.refusals.size(), 1U);
  EXPECT_EQ(host.refusals[0].code, ErrorCode::version_mismatch);
  EXPECT_EQ(host.refusals[0].about, MessageType::hello);
  EXPECT_THAT(host.refusals[0].text, AllOf(HasSubstr("protocol 1."), HasSubstr("major 2"), HasSubstr("older")));
  EXPECT_EQ(box.session.state(), SessionState::waiting);
}

TEST(Handshake, AHostOfLaterMinorsOnlyIsRefused) {
  Box box;
  Host host;
  auto hello = messages::Hello::current();
  hello.min_minor = hello.max_minor = messages::kProtocolMinor + 1;
  box.hear(hello);
  host.read(box.take());
  ASSERT_EQ(host.refusals.size(), 1U);
  EXPECT_EQ(host.refusals[0].code, ErrorCode::version_mismatch);
  EXPECT_THAT(host.refusals[0].text, AllOf(HasSubstr("needs 1." + std::to_string(messages::kProtocolMinor + 1)),
                                           HasSubstr("the box"), Not(HasSubstr("major"))));
}

TEST(Handshake, AnEmptyHelloIsNone) {
  Box box;
  box.hearFrame(MessageType::hello, {});
  EXPECT_EQ(box.session.state(), SessionState::waiting);
}

TEST(Handshake, BeforeItNothingElseIsDone) {
  Box box;
  Host host;
  box.hear(messages::Start{});
  box.hear(messages::Request{1, messages::Operation::status, {}});
  EXPECT_FALSE(box.session.nextRequest().has_value());
  host.read(box.take());
  ASSERT_EQ(host.refusals.size(), 2U);
  EXPECT_EQ(host.refusals[0].code, ErrorCode::wrong_state);
}

TEST(Handshake, TwoBoxesOnOneLineDoNotAnswerEachOther) {
  Box box;
  box.hear(messages::Refusal{ErrorCode::wrong_state, MessageType::start, "say HELLO first"});
  box.hear(messages::Heartbeat{});
  EXPECT_TRUE(box.take().empty());
  EXPECT_EQ(box.session.linkCounters().unexpected, 2U);
}

TEST(Handshake, UnknownTypesAreSkippedAndCounted) {
  Box box;
  Host host;
  begin(box, host);
  box.hearFrame(static_cast<MessageType>(0x7F), {std::byte{1}, std::byte{2}});
  EXPECT_EQ(box.session.linkCounters().unexpected, 1U);
  EXPECT_EQ(box.session.state(), SessionState::streaming);
}

TEST(Start, OfAnUnknownProfileIsRefusedByName) {
  Box box;
  Host host;
  begin(box, host, {.profile = static_cast<messages::Profile>(7)});
  host.read(box.take());
  ASSERT_EQ(host.refusals.size(), 1U);
  EXPECT_EQ(host.refusals[0].code, ErrorCode::refused);
  EXPECT_EQ(box.session.state(), SessionState::greeted);
}

TEST(Start, OfAnotherStreamIsRefusedAndChangesNothing) {
  Box box;
  Host host;
  begin(box, host, {.stream = 2});
  host.read(box.take());
  ASSERT_EQ(host.refusals.size(), 1U);
  EXPECT_EQ(host.refusals[0].code, ErrorCode::refused);
  EXPECT_EQ(host.refusals[0].about, MessageType::start);
  EXPECT_THAT(host.refusals[0].text, HasSubstr("stream 1"));
  EXPECT_EQ(box.session.state(), SessionState::greeted);
  box.hear(messages::Start{});
  for (const auto other : std::array<std::uint8_t, 3>{0, 2, 255}) {
    box.hear(messages::Start{.stream = other});
    box.hear(messages::Stop{.stream = other});
  }
  box.produce(10);
  host.read(box.take());
  EXPECT_EQ(host.refusals.size(), 7U);
  EXPECT_THAT(host.refusals.back().text, HasSubstr("stream 1"));
  EXPECT_EQ(host.received, 10U);
  box.hear(messages::Stop{});
  EXPECT_EQ(box.session.state(), SessionState::greeted);
}

TEST(Start, SentTwiceIsOneStart) {
  Box box;
  Host host;
  begin(box, host);
  box.produce(10);
  box.hear(messages::Start{});
  host.read(box.take());
  EXPECT_EQ(host.received, 10U);
  EXPECT_TRUE(host.refusals.empty());
  box.hear(messages::Start{.policy = messages::Policy::record});
  host.read(box.take());
  ASSERT_EQ(host.refusals.size(), 1U);
  EXPECT_EQ(host.refusals[0].code, ErrorCode::wrong_state);
}

TEST(LinkWatch, ThreeMissedSignsOfLifeAreALinkDownAndHelloBringsItBack) {
  Box box;
  Host host;
  begin(box, host);
  for (int k = 0; k < 15; ++k) box.advance(100ms);
  EXPECT_EQ(box.session.state(), SessionState::streaming) << "three periods of 500 ms are not over";
  box.advance(1ms);
  EXPECT_EQ(box.session.state(), SessionState::down);
  box.produce(10);
  box.take();
  EXPECT_TRUE(box.take().empty()) << "nothing is sent into the void";
  begin(box, host);
  box.produce(10);
  host.read(box.take());
  EXPECT_EQ(box.session.state(), SessionState::streaming);
  EXPECT_GT(host.received, 0U);
}

TEST(LinkWatch, AnySignOfLifeKeepsItUp) {
  Box box;
  Host host;
  begin(box, host);
  for (int k = 0; k < 100; ++k) {
    box.advance(100ms);
    if (k % 10 == 0) box.hear(messages::Credit{});
  }
  EXPECT_EQ(box.session.state(), SessionState::streaming);
}

TEST(LinkWatch, HeartbeatsComeTenASecondAndNeverInABurst) {
  Box box;
  Host host;
  begin(box, host);
  host.read(box.take());
  const auto before = host.beats.size();
  for (int k = 0; k < 100; ++k) {
    box.advance(10ms);
    box.hear(messages::Credit{});
    host.read(box.take());
  }
  EXPECT_EQ(host.beats.size() - before, 10U);
  box.advance(1s);  // the box was busy elsewhere
  box.advance(1ms);
  host.read(box.take());
  EXPECT_EQ(host.beats.size() - before, 11U);
}

TEST(Descriptor, AChangedOneIsSentAndItsHashGoesWithWhatFollows) {
  Box box;
  Host host;
  begin(box, host);
  box.produce(4);
  host.read(box.take());
  auto changed = descriptor();
  changed.delay = {true, {1e-3, 1e-3, 1e-3}, {1e-6, 1e-6, 1e-6}, 7};
  box.describe(changed);
  box.produce(4);
  host.read(box.take());
  EXPECT_EQ(host.reader.descriptor()->delay.result_id, 7U);
  EXPECT_EQ(host.received, 8U);
  EXPECT_EQ(host.reader.faults().unreadable_blocks, 0U);
}

TEST(Garbage, IsCountedAndTheNextHostIsServed) {
  Box box;
  Host host;
  std::uint64_t state = 1;
  for (int k = 0; k < 2000; ++k) {
    std::vector<std::byte> garbage(97);
    for (auto& byte : garbage)
      byte = static_cast<std::byte>((state = state * 6364136223846793005U + 1442695040888963407U) >> 56U);
    box.session.receive(garbage, box.now());
    box.advance(1ms);
  }
  EXPECT_GT(box.session.linkCounters().discarded_bytes, 100'000U);
  box.session.receive(std::vector{frame::kDelimiter}, box.now());
  begin(box, host);
  box.produce(5);
  host.read(box.take());
  EXPECT_EQ(host.received, 5U);
}

}  // namespace
}  // namespace probebox::stream
