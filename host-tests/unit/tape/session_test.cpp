#include "firmware/tape/session.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <vector>

namespace probebox::tape {
namespace {

using testing::ElementsAre;

struct Heard {
  std::vector<std::string> lines;
  int starts{};
};

Heard hear(Session& session, std::string_view bytes, bool sending = false) {
  Heard heard;
  auto rest = std::as_bytes(std::span{bytes});
  while (!rest.empty()) {
    rest = rest.subspan(session.push(rest, sending));
    if (const auto line = session.line()) heard.lines.push_back(line->too_long ? "too long" : line->text);
    if (session.readerStarted()) ++heard.starts;
  }
  return heard;
}

std::string waiting(const Session& session) {
  const auto bytes = session.toSend();
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

TEST(Session, TakesSeveralLinesAtOnceAndInPieces) {
  Session session{false, false};
  EXPECT_THAT(hear(session, "BEGIN1\r\nEND1\nX1").lines, ElementsAre("BEGIN1", "END1"));
  EXPECT_THAT(hear(session, "2.5\r").lines, ElementsAre("X12.5"));
}

TEST(Session, LeavesOutTapeMarksEmptyLinesAndPunchCodes) {
  Session session{true, false};
  EXPECT_THAT(hear(session, "\x12%\r\n\r\nX1\x7F\r\n%\n\x14").lines, ElementsAre("X1"));
}

TEST(Session, DropsTheParityBitWhereItIsOne) {
  Session seven{false, true}, eight{false, false};
  EXPECT_THAT(hear(seven,
                   "\xD8"
                   "1\n")
                  .lines,
              ElementsAre("X1"));
  EXPECT_THAT(hear(eight,
                   "\xD8"
                   "1\n")
                  .lines,
              ElementsAre("\xD8"
                          "1"));
}

TEST(Session, SaysThatALineIsTooLongAndTakesTheNext) {
  Session session{false, false};
  EXPECT_THAT(hear(session, std::string(1000, 'X') + "\nX1\n").lines, ElementsAre("too long", "X1"));
}

TEST(Session, StopsAtXoffAndGoesOnAtXon) {
  Session session{true, false};
  ASSERT_TRUE(session.send("abc"));
  hear(session, "\x13", true);
  EXPECT_EQ(waiting(session), "");
  ASSERT_TRUE(session.send("def"));
  EXPECT_EQ(hear(session, "\x11", true).starts, 0) << "it went on, and asks for nothing";
  EXPECT_EQ(waiting(session), "abcdef");
  session.sent(4);
  EXPECT_EQ(waiting(session), "ef");
}

TEST(Session, TakesAnXonOutOfTheBlueForAReaderThatStarts) {
  Session with{true, false}, without{false, false};
  EXPECT_EQ(hear(with, "\x11").starts, 1);
  EXPECT_EQ(hear(without, "\x11").starts, 0);
}

// Controls stop the reader when they have what they wanted, and start it again for the next tape.
TEST(Session, TakesAnXonBehindAReadThatEndedForTheNext) {
  Session session{true, false};
  ASSERT_TRUE(session.send("%abc%\r\n"));
  session.sent(5);
  EXPECT_EQ(hear(session, "\x13", false).starts, 0);
  EXPECT_EQ(hear(session, "\x11", false).starts, 1);
  EXPECT_EQ(waiting(session), "") << "what lies behind the end is of no use";
  EXPECT_EQ(hear(session, "\x13\x13\x11", false).starts, 1) << "as after noise";
  EXPECT_EQ(hear(session, "\x13", true).starts, 0);
  EXPECT_EQ(hear(session, "\x11", false).starts, 0) << "the last bytes came meanwhile";
}

TEST(Session, SendsATextWholeOrNotAtAll) {
  Session session{true, false};
  hear(session, "\x13");
  ASSERT_TRUE(session.send(std::string(Session::kMostWaiting - 1, 'x')));
  EXPECT_FALSE(session.send("yz"));
  EXPECT_TRUE(session.send("y"));
}

TEST(Session, ForgetsWhatWasBeforeALineWasClosed) {
  Session session{true, false};
  hear(session, "BEG\x13");
  ASSERT_TRUE(session.send("abc"));
  session.restart();
  EXPECT_FALSE(session.stopped());
  EXPECT_EQ(waiting(session), "");
  EXPECT_THAT(hear(session, "X1\n").lines, ElementsAre("X1"));
}

}  // namespace
}  // namespace probebox::tape
