#include "firmware/modbus/line_echo.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vector>

namespace probebox::modbus {
namespace {

using Bytes = std::vector<std::uint8_t>;
using testing::IsEmpty;

const Bytes kWriteOne{1, 6, 0, 138, 0, 1, 0x68, 0x20};  // its own answer
const Bytes kReadAnswer{1, 3, 2, 0x50, 0x42, 0x05, 0x95};
const Bytes kReadRequest{1, 3, 0, 0, 0, 1, 0x84, 0x0A};

// What the server is given of a line that delivers `bytes` in pieces.
Bytes heard(LineEcho& echo, const Bytes& bytes, std::size_t piece) {
  Bytes all;
  const auto take = [&](std::span<const std::byte> part) {
    for (const auto byte : part) all.push_back(static_cast<std::uint8_t>(byte));
  };
  for (std::size_t at = 0; at < bytes.size(); at += piece) {
    const auto size = std::min(piece, bytes.size() - at);
    const auto [held, rest] = echo.strip(std::as_bytes(std::span{bytes}.subspan(at, size)));
    take(held);
    take(rest);
  }
  return all;
}

Bytes operator+(Bytes a, const Bytes& b) {
  a.insert(a.end(), b.begin(), b.end());
  return a;
}

class Pieces : public testing::TestWithParam<std::size_t> {};

TEST_P(Pieces, AnswersThatComeBackAreNotHeard) {
  LineEcho echo;
  echo.sent(kReadAnswer);
  EXPECT_EQ(heard(echo, kReadAnswer + kReadRequest, GetParam()), kReadRequest);
  echo.sent(kWriteOne);
  EXPECT_THAT(heard(echo, kWriteOne, GetParam()), IsEmpty()) << "this line echoes";
  EXPECT_EQ(heard(echo, kWriteOne, GetParam()), kWriteOne) << "the master repeats it";
  EXPECT_EQ(echo.removed(), 2U);
}

TEST_P(Pieces, AMasterMayRepeatAWriteForEverWhereALineDoesNotEcho) {
  LineEcho echo;
  echo.sent(kReadAnswer);
  EXPECT_EQ(heard(echo, kReadRequest, GetParam()), kReadRequest);
  for (int k = 0; k < 100; ++k) {
    echo.sent(kWriteOne);
    EXPECT_EQ(heard(echo, kWriteOne, GetParam()), kWriteOne) << k;
  }
  EXPECT_EQ(echo.removed(), 0U);
}

TEST_P(Pieces, AnEchoOfTheFirstWriteEnds) {
  LineEcho echo;
  int answers = 0;
  Bytes arrives = kWriteOne;
  while (!heard(echo, arrives, GetParam()).empty()) {
    ASSERT_LT(++answers, 100) << "it answers itself for ever";
    echo.sent(kWriteOne);
  }
  EXPECT_EQ(answers, 1 + LineEcho::kMostRepeats);
}

// How often an echo of kWriteOne is answered, with the first answer.
int answersToItself(LineEcho& echo, std::size_t piece) {
  int answers = 1;
  for (echo.sent(kWriteOne); answers < 100 && !heard(echo, kWriteOne, piece).empty(); ++answers) echo.sent(kWriteOne);
  return answers;
}

// On a line that echoes: one that comes late, damaged or behind a disturbance.
TEST_P(Pieces, OneEchoThatIsNotRecognisedLeavesALimit) {
  const std::size_t piece = GetParam();
  const auto after = [&](const auto& disturb) {
    LineEcho echo;
    echo.sent(kReadAnswer);
    heard(echo, kReadAnswer, piece);
    for (int k = 0; k < 5; ++k) {
      echo.sent(kReadAnswer);
      disturb(echo);
      EXPECT_LE(answersToItself(echo, piece), 1 + LineEcho::kMostRepeats) << "disturbance " << k;
      echo.sent(kReadAnswer);
      heard(echo, kReadAnswer, piece);
    }
  };
  after([&](LineEcho& echo) { heard(echo, Bytes{1, 3, 2, 0x51, 0x42, 0x05, 0x95}, piece); });
  after([](LineEcho& echo) { echo.silence(); });
  after([&](LineEcho& echo) {
    echo.silence();
    heard(echo, kReadAnswer, piece);
    heard(echo, kReadRequest, piece);
  });
  after([&](LineEcho& echo) { heard(echo, Bytes{0xFF} + kReadAnswer, piece); });
  after([&](LineEcho& echo) { heard(echo, Bytes{0xFF} + kReadAnswer + kReadRequest, piece); });
}

TEST_P(Pieces, ALineThatDamagesEveryEchoKeepsTheLimit) {
  LineEcho echo;
  for (int k = 0; k < 20; ++k) {
    echo.sent(kReadAnswer);
    heard(echo, Bytes{1, 3, 2, 0x51, 0x42, 0x05, 0x95}, GetParam());
    EXPECT_LE(answersToItself(echo, GetParam()), 1 + LineEcho::kMostRepeats) << k;
  }
}

// A master that is slow to ask again.
TEST_P(Pieces, TwoAnswersThatDoNotComeBackShowThatALineDoesNotEcho) {
  LineEcho echo;
  for (int k = 0; k < 2; ++k) {
    echo.sent(kReadAnswer);
    echo.silence();
  }
  for (int k = 0; k < 10; ++k) {
    echo.sent(kWriteOne);
    EXPECT_EQ(heard(echo, kWriteOne, GetParam()), kWriteOne) << k;
  }
}

INSTANTIATE_TEST_SUITE_P(Cut, Pieces, testing::Values(1, 3, 100));

TEST(LineEcho, LearnsAnewWhenTheAdapterIsAnother) {
  LineEcho echo;
  echo.sent(kReadAnswer);
  heard(echo, kReadAnswer, 100);
  echo.sent(kReadAnswer);
  EXPECT_TRUE(echo.awaiting());
  echo.silence();
  EXPECT_FALSE(echo.awaiting());
  echo.sent(kWriteOne);
  EXPECT_EQ(heard(echo, kWriteOne, 100), kWriteOne) << "this one does not echo";
}

TEST(LineEcho, GivesBackWhatOnlyBeganLikeAnEcho) {
  LineEcho echo;
  echo.sent(kWriteOne);
  const Bytes other{1, 6, 0, 138, 0, 0, 0xA9, 0xE0};
  EXPECT_EQ(heard(echo, other, 2), other);
}

}  // namespace
}  // namespace probebox::modbus
