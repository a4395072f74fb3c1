#include "tools/link/recording.hpp"

#include <gtest/gtest.h>
#include <sstream>

#include "box_pipe.hpp"
#include "tools/link/client.hpp"

namespace probebox::link {
namespace {

struct Recorder : Tally {
  void onFrame(const frame::Frame& frame) override { EXPECT_TRUE(writer.write(frame)); }
  std::ostringstream out;
  RecordingWriter writer{out};
};

// A short recording, as `record` writes it.
struct Recorded {
  std::string bytes;
  std::uint64_t samples{};
};

Recorded recorded(bool closed) {
  World world;
  Recorder recorder;
  Client client{std::move(world.owned), {}, &recorder};
  EXPECT_TRUE(client.connect(world.wait(20)).ok());
  client.start({});
  const auto wait = world.wait(45);
  while (client.round(wait)) {
  }
  EXPECT_TRUE(!closed || client.finish(world.wait(50)).ok());
  return {recorder.out.str(), recorder.samples};
}

TEST(Recording, IsReadByTheReaderOfTheWire) {
  const auto recording = recorded(true);
  std::istringstream in{recording.bytes};
  Tally tally;
  const auto end = readRecording(in, tally);
  ASSERT_TRUE(end.ok());
  EXPECT_EQ(tally.samples, recording.samples);
  EXPECT_EQ(tally.wrong, 0U);
  EXPECT_EQ(tally.inexact, 0U);
  EXPECT_TRUE(end->closed);
  EXPECT_EQ(end->cut_bytes, 0U);
  EXPECT_EQ(end->frames.bad(), 0U);
  ASSERT_TRUE(end->balance.has_value());
  EXPECT_TRUE(end->balance->exact);
}

TEST(Recording, OfAKilledProcessSaysThatItsTailIsUnknown) {
  const auto recording = recorded(false);
  std::istringstream in{recording.bytes};
  Tally tally;
  const auto end = readRecording(in, tally);
  ASSERT_TRUE(end.ok());
  EXPECT_FALSE(end->closed);
  EXPECT_EQ(tally.samples, recording.samples);
}

TEST(Recording, CutAtAnyByteIsReadUpToThere) {
  const auto whole = recorded(true).bytes;
  std::uint64_t before = 0;
  bool readable = false;
  for (std::size_t size = 0; size < whole.size(); ++size) {
    std::istringstream in{whole.substr(0, size)};
    Tally tally;
    const auto end = readRecording(in, tally);
    EXPECT_TRUE(end.ok() || !readable) << "more bytes, less to read";
    readable = end.ok();
    if (!end) continue;
    EXPECT_GE(tally.samples, before);
    EXPECT_EQ(tally.wrong, 0U);
    EXPECT_EQ(tally.inexact, 0U) << size;
    EXPECT_EQ(end->frames.bad(), 0U);
    before = tally.samples;
  }
  EXPECT_GT(before, 0U);
}

TEST(Recording, WithAHoleInTheMiddleStillAddsUp) {
  const auto whole = recorded(true).bytes;
  for (const std::size_t at : {whole.size() / 3, whole.size() / 2}) {
    auto holed = whole;
    holed.erase(at, 700);
    std::istringstream in{holed};
    Tally tally;
    const auto end = readRecording(in, tally);
    ASSERT_TRUE(end.ok());
    EXPECT_EQ(tally.inexact, 0U);
    EXPECT_GT(tally.inferred, 0U);
    EXPECT_EQ(end->balance->account.total(), end->balance->produced);
  }
}

TEST(Recording, ThatIsNoneIsRefusedWithTheReason) {
  Tally tally;
  for (const std::string text : {"", "a,b,c\n1,2,3\n"}) {
    std::istringstream in{text};
    const auto end = readRecording(in, tally);
    ASSERT_FALSE(end.ok());
    EXPECT_NE(end.error().what.find("recording"), std::string::npos);
  }
  const auto missing = readRecording("/nonexistent/file.pbx", tally);
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().what.find("/nonexistent/file.pbx"), std::string::npos);
}

}  // namespace
}  // namespace probebox::link
