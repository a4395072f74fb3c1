#include "firmware/modbus/rtu_requests.hpp"

#include <gmock/gmock.h>
#include <random>
#include <rapidcheck/gtest.h>

namespace probebox::modbus {
namespace {

using Bytes = std::vector<std::uint8_t>;

Bytes withCrc(Bytes frame) {
  const auto crc = crc16(frame);
  frame.push_back(static_cast<std::uint8_t>(crc));
  frame.push_back(static_cast<std::uint8_t>(crc >> 8));
  return frame;
}
const Bytes kReadFirstBlock = withCrc({1, 3, 0, 0, 0, 38});
const Bytes kWriteTwo = withCrc({1, 16, 0, 144, 0, 2, 4, 0, 0, 0, 7});

Bytes bytesOf(const Request& request) {
  return {request.bytes.begin(), request.bytes.begin() + static_cast<std::ptrdiff_t>(request.size)};
}

// Delivers bytes in pieces, as a line does.
std::vector<Bytes> requestsIn(RtuRequests& requests, const Bytes& line, std::size_t piece) {
  std::vector<Bytes> found;
  for (std::size_t at = 0; at < line.size();) {
    const auto size = std::min(piece, line.size() - at);
    const auto taken = requests.push(std::as_bytes(std::span{line}.subspan(at, size)));
    while (const auto request = requests.next()) found.push_back(bytesOf(*request));
    EXPECT_GT(taken, 0U) << "the line has come to a stand";
    if (taken == 0) break;
    at += taken;
  }
  return found;
}

TEST(Crc16, IsThatOfTheStandardsExample) {
  // Modbus over serial line 1.02, figure in section 6.2.2: the message 02 07 has the CRC 41 12 on the wire.
  EXPECT_EQ(crc16(Bytes{0x02, 0x07}), 0x1241);
}

TEST(RtuRequests, ReadAddressAndCount) {
  RtuRequests requests;
  const auto found = requestsIn(requests, kReadFirstBlock, 8);
  ASSERT_EQ(found.size(), 1U);
  requests.push(std::as_bytes(std::span{kWriteTwo}));
  const auto request = requests.next();
  ASSERT_TRUE(request);
  EXPECT_EQ(request->unit(), 1);
  EXPECT_EQ(request->function(), Function::write_many);
  EXPECT_EQ(request->address(), 144);
  EXPECT_EQ(request->word(4), 2);
  EXPECT_EQ(requests.skippedBytes(), 0U);
}

RC_GTEST_PROP(RtuRequests, FindEveryRequestHoweverTheLineCutsIt, (std::uint8_t piece, std::vector<bool> kinds)) {
  Bytes line;
  std::vector<Bytes> sent;
  for (const bool write : kinds) {
    sent.push_back(write ? kWriteTwo : kReadFirstBlock);
    line.insert(line.end(), sent.back().begin(), sent.back().end());
  }
  RtuRequests requests;
  RC_ASSERT(requestsIn(requests, line, piece % 40 + 1U) == sent);
  RC_ASSERT(requests.badFrames() == 0U);
}

// No value that no master sent, whatever noise there is; a request after a pause is always found.
TEST(RtuRequests, FindOnlyWhatWasSentInALongNoise) {
  std::mt19937_64 random{7};
  RtuRequests requests;
  std::size_t sent = 0;
  std::size_t found = 0;
  std::uint64_t noise_bytes = 0;
  for (int round = 0; round < 3000; ++round) {
    Bytes noise(random() % 300);
    for (auto& byte : noise) byte = static_cast<std::uint8_t>(random());
    noise_bytes += noise.size();
    // Sound frames to other units may turn up in noise; a master's own request may not.
    for (const auto& frame : requestsIn(requests, noise, 1 + random() % 64)) EXPECT_NE(frame, kReadFirstBlock);
    requests.silence();
    ++sent;
    for (const auto& frame : requestsIn(requests, kReadFirstBlock, 1 + random() % 8))
      if (frame == kReadFirstBlock) ++found;
  }
  EXPECT_EQ(found, sent);
  EXPECT_LE(requests.skippedBytes(), noise_bytes);
  EXPECT_GE(requests.skippedBytes() + 100, noise_bytes);
}

TEST(RtuRequests, FindARequestThatFollowsNoiseWithoutAPause) {
  Bytes line{255, 0, 250, 9, 9};
  line.insert(line.end(), kReadFirstBlock.begin(), kReadFirstBlock.end());
  RtuRequests requests;
  EXPECT_THAT(requestsIn(requests, line, 100), ::testing::ElementsAre(kReadFirstBlock));
  EXPECT_EQ(requests.skippedBytes(), 5U);
  EXPECT_EQ(requests.badFrames(), 1U);
}

// A write of 123 registers whose values spell a request: not to be done, whether its rest comes or not.
TEST(RtuRequests, TakeNoRequestOutOfAFrameThatIsNotWhole) {
  Bytes line{1, 16, 0, 0, 0, 123, 246, 9, 9};
  line.insert(line.end(), kWriteTwo.begin(), kWriteTwo.end());
  RtuRequests requests;
  EXPECT_TRUE(requestsIn(requests, line, 100).empty());
  requests.silence();
  EXPECT_THAT(requestsIn(requests, kReadFirstBlock, 8), ::testing::ElementsAre(kReadFirstBlock));
}

// An answer of unit 2 to a read, whose data are a write to unit 1.
Bytes answerWith(const Bytes& inside, int spoilt) {
  Bytes answer{2, 3, static_cast<std::uint8_t>(inside.size() + 3), 7};
  answer.insert(answer.end(), inside.begin(), inside.end());
  answer.insert(answer.end(), {8, 9});
  answer = withCrc(answer);
  answer.back() = static_cast<std::uint8_t>(answer.back() ^ spoilt);
  return answer;
}

TEST(RtuRequests, TakeNoRequestOutOfTheAnswerOfAnotherUnit) {
  for (const std::size_t piece : {std::size_t{1}, std::size_t{5}, std::size_t{100}}) {
    RtuRequests requests;
    EXPECT_TRUE(requestsIn(requests, answerWith(kWriteTwo, 0), piece).empty()) << piece;
    EXPECT_THAT(requestsIn(requests, kReadFirstBlock, piece), ::testing::ElementsAre(kReadFirstBlock))
        << "right behind";
    EXPECT_EQ(requests.badFrames(), 0U);
  }
}

// A write whose first eight bytes have the CRC of an answer to it.
TEST(RtuRequests, WaitForAWriteThatBeginsLikeAnAnswer) {
  std::size_t alike = 0;
  for (unsigned k = 0; k < 8 * 1024; ++k) {
    const auto address = k / 8, count = 1 + k % 8;
    Bytes write{1,
                16,
                static_cast<std::uint8_t>(address >> 8),
                static_cast<std::uint8_t>(address),
                0,
                static_cast<std::uint8_t>(count)};
    const auto answer = withCrc(write);
    if (answer[6] != 2 * count) continue;
    ++alike;
    write.insert(write.end(), {answer[6], answer[7]});
    write.resize(write.size() + 2 * count - 1);
    write = withCrc(write);
    RtuRequests requests;
    EXPECT_THAT(requestsIn(requests, write, 8), ::testing::ElementsAre(write));
  }
  EXPECT_GT(alike, 0U);
}

TEST(RtuRequests, TakeNoRequestOutOfAFrameWithABadCrc) {
  for (const std::size_t piece : {std::size_t{1}, std::size_t{5}, std::size_t{100}}) {
    RtuRequests requests;
    EXPECT_TRUE(requestsIn(requests, answerWith(kWriteTwo, 1), piece).empty()) << piece;
    EXPECT_FALSE(requests.afterPause()) << piece;
    requests.silence();
    EXPECT_EQ(requests.badFrames(), 1U);
    EXPECT_THAT(requestsIn(requests, kReadFirstBlock, piece), ::testing::ElementsAre(kReadFirstBlock));
  }
}

// Short answers and exceptions of another unit between the requests to it and to this one.
TEST(RtuRequests, FollowATalkOfTheMasterWithOthers) {
  const Bytes others[]{withCrc({2, 3, 2, 0, 5}), withCrc({2, 0x83, 2}), withCrc({2, 6, 0, 1, 0, 3}),
                       withCrc({2, 16, 0, 1, 0, 3})};
  for (const auto& other : others) {
    const auto to_other = withCrc({2, 3, 0, 1, 0, 1});
    Bytes line;
    for (const auto* frame : {&to_other, &other, &kReadFirstBlock})
      line.insert(line.end(), frame->begin(), frame->end());
    for (const std::size_t piece : {std::size_t{1}, std::size_t{100}}) {
      RtuRequests requests;
      const auto found = requestsIn(requests, line, piece);
      ASSERT_FALSE(found.empty());
      EXPECT_EQ(found.back(), kReadFirstBlock) << int{other[1]};
      EXPECT_EQ(requests.badFrames(), 0U) << int{other[1]};
    }
  }
}

// A read of the device identification, a user-defined function, a file record, one without data.
const std::vector<Bytes> kUnknownFunctions{withCrc({1, 43, 14, 1, 0}), withCrc({1, 65, 1, 2, 3, 4, 5, 6}),
                                           withCrc({1, 20, 7, 6, 0, 4, 0, 1, 0, 2}), withCrc({1, 100})};

TEST(RtuRequests, FindRequestsOfUnknownFunctionsSoThatTheyCanBeRefused) {
  for (const auto& unknown : kUnknownFunctions) {
    for (const std::size_t piece : {std::size_t{1}, std::size_t{3}, std::size_t{100}}) {
      RtuRequests requests;
      EXPECT_THAT(requestsIn(requests, unknown, piece), ::testing::ElementsAre(unknown)) << int{unknown[1]};
      EXPECT_THAT(requestsIn(requests, kReadFirstBlock, piece), ::testing::ElementsAre(kReadFirstBlock));
      EXPECT_THAT(requestsIn(requests, unknown, piece), ::testing::ElementsAre(unknown)) << "right behind a request";
      EXPECT_EQ(requests.skippedBytes(), 0U);
    }
  }
}

TEST(RtuRequests, TakeNoUnknownFunctionOutOfGarbageOrAnAnswer) {
  for (const auto& unknown : kUnknownFunctions) {
    RtuRequests requests;
    Bytes behind_garbage{255};
    behind_garbage.insert(behind_garbage.end(), unknown.begin(), unknown.end());
    const bool has_length = unknown[1] == 43 || unknown[1] == 20;
    EXPECT_EQ(requestsIn(requests, behind_garbage, 100).empty(), !has_length) << "nobody says where it begins";
    requests.silence();
    auto damaged = unknown;
    damaged.back() ^= 1;
    EXPECT_TRUE(requestsIn(requests, damaged, 1).empty());
    requests.silence();
    EXPECT_THAT(requestsIn(requests, kReadFirstBlock, 3), ::testing::ElementsAre(kReadFirstBlock));
    EXPECT_EQ(requests.skippedBytes(), (has_length ? 1 : behind_garbage.size()) + damaged.size());
  }
  RtuRequests requests;
  EXPECT_TRUE(requestsIn(requests, withCrc({1, 0x83, 2}), 1).empty()) << "an exception of another unit";
}

TEST(RtuRequests, WaitForTheEndOfAnUnknownFunctionOnlyAsLongAsAFrameCanBe) {
  Bytes endless(300, 43);
  endless[0] = 1;
  RtuRequests requests;
  EXPECT_TRUE(requestsIn(requests, endless, 7).empty());
  EXPECT_GT(requests.skippedBytes(), 200U);
  EXPECT_THAT(requestsIn(requests, kReadFirstBlock, 8), ::testing::ElementsAre(kReadFirstBlock));
}

const Bytes kWriteRegister = withCrc({1, 6, 0, 144, 0, 7});

// What is answered when the bytes have come and the line pauses.
std::vector<Bytes> withPause(RtuRequests& requests, const Bytes& line, std::size_t piece) {
  auto found = requestsIn(requests, line, piece);
  if (const auto request = requests.afterPause()) found.push_back(bytesOf(*request));
  return found;
}

TEST(RtuRequests, FindARequestBehindAnyByteAndBeforeAnyInEveryCycle) {
  for (const auto& request : {kReadFirstBlock, kWriteRegister, kWriteTwo}) {
    for (unsigned noise = 0; noise < 256; ++noise) {
      for (const std::size_t piece : {std::size_t{1}, std::size_t{5}, std::size_t{100}}) {
        RtuRequests before, behind;
        Bytes line{static_cast<std::uint8_t>(noise)};
        line.insert(line.end(), request.begin(), request.end());
        Bytes followed = request;
        followed.push_back(static_cast<std::uint8_t>(noise));
        for (int cycle = 0; cycle < 3; ++cycle) {
          ASSERT_THAT(withPause(before, line, piece), ::testing::ElementsAre(request)) << noise << " before";
          ASSERT_THAT(withPause(behind, followed, piece), ::testing::ElementsAre(request)) << noise << " behind";
        }
      }
    }
  }
}

TEST(RtuRequests, FindReadsBehindAWriteThatWasTornOff) {
  const auto write = withCrc({1, 16, 0, 144, 0, 2, 4, 0, 0, 0, 9});
  ASSERT_NE(write.back(), kReadFirstBlock.front()) << "else a read makes it whole";
  for (std::size_t torn = 1; torn < write.size(); ++torn) {
    RtuRequests requests;
    requestsIn(requests, {write.begin(), write.begin() + static_cast<std::ptrdiff_t>(torn)}, 4);
    for (int cycle = 0; cycle < 5; ++cycle)
      EXPECT_THAT(withPause(requests, kReadFirstBlock, 3), ::testing::ElementsAre(kReadFirstBlock)) << torn;
  }
  RtuRequests requests;
  const Bytes header{1, 16, 0, 0, 0, 123, 246};
  EXPECT_TRUE(withPause(requests, header, 4).empty());
  EXPECT_TRUE(withPause(requests, kWriteTwo, 4).empty()) << "it may be what the header's write is to write";
}

TEST(RtuRequests, ForgetABrokenRequestAtSilence) {
  RtuRequests requests;
  requestsIn(requests, {kReadFirstBlock.begin(), kReadFirstBlock.begin() + 5}, 5);
  EXPECT_TRUE(requests.pending());
  requests.silence();
  EXPECT_FALSE(requests.pending());
  EXPECT_EQ(requests.badFrames(), 1U);
  EXPECT_THAT(requestsIn(requests, kReadFirstBlock, 3), ::testing::ElementsAre(kReadFirstBlock));
}

RC_GTEST_PROP(RtuRequests, TakeNoRequestWithAFlippedBit, (std::uint16_t where)) {
  auto damaged = kWriteTwo;
  const auto bit = where % (damaged.size() * 8);
  damaged[bit / 8] ^= static_cast<std::uint8_t>(1U << bit % 8);
  RtuRequests requests;
  RC_ASSERT(requestsIn(requests, damaged, 4).empty());
}

}  // namespace
}  // namespace probebox::modbus
