#include "tools/link/recording.hpp"

#include <gtest/gtest.h>
#include <numeric>
#include <sstream>

#include "box_pipe.hpp"
#include "tools/link/client.hpp"
#include "tools/link/recording_maker.hpp"

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

// Pieces are 64 kB; what was asked for has come by then.
// A list of empty descriptions is short, and its samples would take gigabytes.
TEST(Recording, WithMoreChannelsThanABlockCanHoldHasNoDescriptor) {
  messages::Descriptor descriptor;
  descriptor.channels.resize(300);
  Tally tally;
  StreamReader reader{tally};
  const auto payload = messages::encoded(descriptor);
  std::vector<std::byte> scratch(frame::bareSize(payload.size())), coded(frame::delimitedMaxSize(payload.size()));
  frame::Header header;
  header.type = static_cast<std::uint8_t>(messages::MessageType::descriptor);
  reader.read(std::span{coded}.first(frame::encodeDelimited(header, payload, scratch, coded)));
  EXPECT_EQ(reader.faults().malformed, 1U);
  EXPECT_FALSE(reader.descriptor());
}

TEST(Recording, IsReadNoFurtherThanIsWanted) {
  const auto recording = recorded(true);
  std::string bytes;
  while (bytes.size() < 300'000) bytes += recording.bytes;
  std::istringstream in{bytes};
  Tally tally;
  const auto end = readRecording(in, tally, {}, [&] { return tally.samples > 0; });
  ASSERT_TRUE(end.ok());
  EXPECT_GT(tally.samples, 0U);
  EXPECT_LT(end->bytes, bytes.size() / 2);
  std::istringstream again{bytes};
  EXPECT_FALSE(readRecording(again, tally, {}, [] { return true; })) << "nothing was wanted";
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

class RecordingInProfile : public testing::TestWithParam<messages::Profile> {};

// A table's worth, then another descriptor, then more: whole frames are read, and what is cut is said with its place.
TEST_P(RecordingInProfile, UnderTwoDescriptorsCutAtAnyByteIsReadUpToThere) {
  std::ostringstream out;
  std::vector<std::int64_t> column(90);
  std::iota(column.begin(), column.end(), 500);
  const std::vector<std::span<const std::int64_t>> columns{column};
  messages::Descriptor d;
  d.channels = {{"a", "nm", 1.0, 4, true, ""}};
  RecordingMaker maker{out, GetParam(), 30};
  ASSERT_TRUE(maker.begin(d));
  ASSERT_TRUE(maker.add({500}, columns));
  d.delay.result_id = 9;
  ASSERT_TRUE(maker.describe(d));
  for (auto& value : column) value += 95;
  ASSERT_TRUE(maker.add({595}, columns));
  ASSERT_TRUE(maker.end());
  const auto whole = out.str();
  struct Heard : Tally {
    void onBlock(const DecodedBlock& block) override {
      Tally::onBlock(block);
      misplaced += block.descriptor.delay.result_id != (block.header.first < SampleIndex{595} ? 0U : 9U);
    }
    std::uint64_t misplaced{};
  };
  std::uint64_t before = 0;
  for (std::size_t size = 1; size <= whole.size(); ++size) {
    std::istringstream in{whole.substr(0, size)};
    Heard heard;
    const auto end = readRecording(in, heard);
    if (!end) continue;
    // The end of the last whole frame, told independently of the reader: behind its delimiter.
    const auto last = whole.rfind('\0', size - 1) + 1;
    EXPECT_EQ(end->bytes - end->cut_bytes, last) << size;
    EXPECT_EQ(heard.wrong + heard.misplaced + heard.inexact, 0U) << size;
    EXPECT_EQ(end->frames.bad(), 0U);
    EXPECT_GE(heard.samples, before);
    EXPECT_EQ(end->closed, size == whole.size());
    before = heard.samples;
  }
  EXPECT_EQ(before, 180U);
}

INSTANTIATE_TEST_SUITE_P(EachStandsAloneOrNot, RecordingInProfile,
                         testing::Values(messages::Profile::fast, messages::Profile::tight),
                         [](const auto& of_one) { return std::string{messages::nameOf(of_one.param)}; });

// In profile tight what was cut away costs the samples up to the next key block, and says so.
TEST(Recording, OfTightBlocksWithoutItsFirstOneIsLostUpToTheNextKey) {
  std::ostringstream out;
  std::vector<std::int64_t> column(20'000);
  std::iota(column.begin(), column.end(), 0);
  messages::Descriptor d;
  d.channels = {{"a", "nm", 1.0, 4, true, ""}};
  RecordingMaker maker{out, messages::Profile::tight, 256};
  ASSERT_TRUE(maker.begin(d));
  const auto begin = out.str().size();
  ASSERT_TRUE(maker.add({0}, std::vector<std::span<const std::int64_t>>{column}));
  ASSERT_TRUE(maker.end());
  auto bytes = out.str();
  bytes.erase(begin, bytes.find('\0', begin) + 1 - begin);
  std::istringstream in{bytes};
  Tally tally;
  const auto end = readRecording(in, tally);
  ASSERT_TRUE(end.ok());
  EXPECT_EQ(end->faults.keyless_blocks, 63U);
  EXPECT_EQ(tally.samples, 20'000 - 64 * 256U);
  EXPECT_EQ(tally.wrong, 0U);
  EXPECT_EQ(end->unexplained, 0U);
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
