#include "firmware/stream/greeting.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>
#include <string_view>

#include "box.hpp"

namespace probebox::stream {
namespace {

using Verdict = HelloGate::Verdict;
using testing::HasSubstr;

std::vector<std::byte> frameOf(messages::MessageType type, const std::vector<std::byte>& payload,
                               std::uint8_t major = messages::kProtocolMajor) {
  std::vector<std::byte> scratch(frame::bareSize(payload.size()));
  std::vector<std::byte> coded(frame::delimitedMaxSize(payload.size()));
  coded.resize(frame::encodeDelimited({.major = major, .type = static_cast<std::uint8_t>(type), .sequence = 7}, payload,
                                      scratch, coded));
  return coded;
}

std::vector<std::byte> helloFrame(const messages::Hello& hello = messages::Hello::current(),
                                  std::uint8_t major = messages::kProtocolMajor) {
  return frameOf(messages::MessageType::hello, messages::encoded(hello), major);
}

std::vector<std::byte> operator+(std::vector<std::byte> a, const std::vector<std::byte>& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

std::vector<std::byte> bytesOf(std::string_view text) {
  const auto* begin = reinterpret_cast<const std::byte*>(text.data());
  return {begin, begin + text.size()};
}

// The verdict, and after how many bytes it fell.
struct Judged {
  Verdict verdict{};
  std::size_t after{};
};
Judged judged(std::span<const std::byte> bytes) {
  HelloGate gate;
  for (std::size_t k = 0; k < bytes.size(); ++k) {
    const auto verdict = gate.push(bytes.subspan(k, 1));
    if (verdict != Verdict::undecided) return {verdict, k + 1};
  }
  return {Verdict::undecided, bytes.size()};
}

TEST(HelloGate, LetsAHelloInAtItsLastByteHoweverItIsCut) {
  const auto hello = helloFrame();
  const auto one_by_one = judged(hello);
  EXPECT_EQ(one_by_one.verdict, Verdict::hello);
  EXPECT_EQ(one_by_one.after, hello.size());
  const std::vector<std::byte> zeros(5, frame::kDelimiter);
  EXPECT_EQ(judged(zeros + hello).verdict, Verdict::hello) << "a zero ends old garbage on a serial line";
  HelloGate gate;
  EXPECT_EQ(gate.push(zeros + hello), Verdict::hello);
  EXPECT_EQ(gate.bytes().size(), zeros.size() + hello.size()) << "the session hears all of it";
  EXPECT_FALSE(gate.refusal());
}

TEST(HelloGate, IsClosedToHttpAtItsFirstByteWhateverTheBodyHolds) {
  for (const auto* line : {"POST / HTTP/1.1\r\nHost: box\r\n\r\n", "GET / HTTP/1.1\r\n\r\n", "\r\n", " "}) {
    const auto request = judged(bytesOf(line) + std::vector{frame::kDelimiter} + helloFrame());
    EXPECT_EQ(request.verdict, Verdict::stranger) << line;
    EXPECT_EQ(request.after, 1U) << line;
  }
  const auto tls = judged(std::vector{std::byte{0x16}, std::byte{3}, std::byte{1}});
  EXPECT_EQ(tls.verdict, Verdict::stranger);
}

TEST(HelloGate, IsClosedToOtherMessagesAndToDamagedOnes) {
  using messages::MessageType;
  EXPECT_EQ(judged(frameOf(MessageType::request, messages::encoded(messages::Request{}))).verdict, Verdict::stranger);
  EXPECT_EQ(judged(frameOf(MessageType::hello, {})).verdict, Verdict::stranger) << "no magic";
  auto other_magic = messages::Hello::current();
  other_magic.magic[3] = '2';
  EXPECT_EQ(judged(helloFrame(other_magic)).verdict, Verdict::stranger);
  const auto good = helloFrame();
  for (std::size_t k = 0; k < good.size() - 1; ++k) {
    auto damaged = good;
    damaged[k] ^= std::byte{0x80};
    EXPECT_EQ(judged(damaged + helloFrame()).verdict, Verdict::stranger) << "byte " << k;
  }
}

TEST(HelloGate, DoesNotWaitForAHelloThatNeverEnds) {
  auto endless = helloFrame();
  endless.pop_back();
  endless.resize(2 * HelloGate::kMostBytes, std::byte{1});
  const auto long_one = judged(endless);
  EXPECT_EQ(long_one.verdict, Verdict::stranger);
  EXPECT_LE(long_one.after, HelloGate::kMostBytes);
  EXPECT_EQ(judged(std::vector(2 * HelloGate::kMostBytes, frame::kDelimiter)).verdict, Verdict::stranger);
}

TEST(HelloGate, KnowsAHostOfAnotherVersionFromAStranger) {
  HelloGate gate;
  auto hello = messages::Hello::current();
  hello.min_minor = hello.max_minor = messages::kProtocolMinor + 3;
  EXPECT_EQ(gate.push(helloFrame(hello)), Verdict::hello);
  ASSERT_TRUE(gate.refusal());
  EXPECT_THAT(gate.refusal()->text, HasSubstr("needs 1." + std::to_string(messages::kProtocolMinor + 3)));
  HelloGate other;
  EXPECT_EQ(other.push(helloFrame(messages::Hello::current(), 2)), Verdict::hello);
  ASSERT_TRUE(other.refusal());
  EXPECT_THAT(other.refusal()->text, HasSubstr("major 2"));
}

TEST(RefusalFrame, IsReadByAHostWithoutASession) {
  Host host;
  host.read(refusalFrame({messages::ErrorCode::busy, messages::MessageType::hello, "all 8 links are taken"}));
  ASSERT_EQ(host.refusals.size(), 1U);
  EXPECT_EQ(host.refusals[0].code, messages::ErrorCode::busy);
  EXPECT_EQ(host.refusals[0].text, "all 8 links are taken");
}

}  // namespace
}  // namespace probebox::stream
