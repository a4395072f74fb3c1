#include <algorithm>
#include <array>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>

#include "host-tests/support/file_content.hpp"
#include "in_process.hpp"
#include "runtime_directory.hpp"
#include "tools/link/recording_maker.hpp"

// Recordings joined by `cat`: channels that change in the middle, links that end without a closing ledger.
namespace probebox::command {
namespace {

using support::contentOf;
using testing::HasSubstr;

std::string packed(const std::string& table) {
  const auto done = probebox({"pack", "-", "-"}, table);
  EXPECT_EQ(done.status, 0) << done.err;
  return done.out;
}

// The recording of a box with another boot id.
struct OfBoot : link::StreamListener {
  explicit OfBoot(std::byte id) : id_{id} {}
  void onFrame(const frame::Frame& frame) override {
    auto welcome = messages::decode<messages::Welcome>(frame.payload);
    if (frame.header.type != static_cast<std::uint8_t>(messages::MessageType::welcome) || !welcome) {
      EXPECT_TRUE(writer_.write(frame));
      return;
    }
    welcome->boot_id.fill(id_);
    const auto payload = messages::encoded(*welcome);
    auto header = frame.header;
    header.payload_length = static_cast<std::uint16_t>(payload.size());
    EXPECT_TRUE(writer_.write({header, payload}));
  }
  std::string of(const std::string& recording) {
    std::istringstream in{recording};
    EXPECT_TRUE(link::readRecording(in, *this).ok());
    return out_.str();
  }

 private:
  std::byte id_;
  std::ostringstream out_;
  link::RecordingWriter writer_{out_};
};

std::string ofBoot(std::byte id, const std::string& recording) {
  return OfBoot{id}.of(recording);
}

// Without its last frame, the closing ledger: the process was killed, or the box.
std::string withoutEnd(const std::string& recording) {
  return recording.substr(0, recording.rfind('\0', recording.size() - 2) + 1);
}

std::string rows(int first, int end) {
  std::string table = "sample,x\n";
  for (int k = first; k < end; ++k) table += std::to_string(k) + "," + std::to_string(k % 100) + "\n";
  return packed(table);
}

// 90 samples under each of two descriptors.
std::string underTwoDescriptors() {
  std::ostringstream out;
  link::RecordingMaker maker{out, messages::Profile::fast, 30};
  std::vector<std::int64_t> column(90, 5);
  const std::array<std::span<const std::int64_t>, 1> columns{column};
  messages::Descriptor descriptor;
  descriptor.channels = {{"x", "nm", 1.0, 4, true, ""}};
  EXPECT_TRUE(maker.begin(descriptor) && maker.add({500}, columns));
  descriptor.delay.result_id = 9;
  EXPECT_TRUE(maker.describe(descriptor) && maker.add({590}, columns) && maker.end());
  return out.str();
}

// Without its first `count` frames.
std::string withoutFrames(std::string recording, int count) {
  for (; count > 0; --count) recording.erase(0, recording.find('\0', 1) + 1);
  return recording;
}

// Samples of one channel that counts 5; its scale is in a descriptor of its own.
std::string fives(int first, std::size_t count, double scale) {
  std::ostringstream out;
  link::RecordingMaker maker{out, messages::Profile::fast, count};
  const std::vector<std::int64_t> column(count, 5);
  const std::array<std::span<const std::int64_t>, 1> columns{column};
  messages::Descriptor descriptor;
  descriptor.channels = {{"x", "nm", scale, 4, true, ""}};
  EXPECT_TRUE(maker.begin(descriptor) && maker.add({first}, columns) && maker.end());
  return out.str();
}

// Handshake and ledger of a stream that has one channel and no sample.
std::string withoutSamples() {
  std::ostringstream out;
  link::RecordingMaker maker{out, messages::Profile::fast, 64};
  messages::Descriptor descriptor;
  descriptor.channels = {{"only", "nm", 1.0, 4, true, ""}};
  EXPECT_TRUE(maker.begin(descriptor) && maker.end());
  return out.str();
}

TEST(JoinedRecordings, AreWatchedWithTheChannelsOfTheirSamples) {
  const auto bytes = packed("sample,x_nm,y_nm,z_nm\n1,10,20,30\n") + withoutSamples();
  const auto watched = probebox({"-u", "file:-", "watch", "--json"}, bytes);
  ASSERT_GE(watched.objects().size(), 2U) << watched.err;
  for (const auto& object : watched.objects())
    EXPECT_EQ(object["values"].dump(), R"({"x_nm":10.0,"y_nm":20.0,"z_nm":30.0})");
  EXPECT_THAT(probebox({"-u", "file:-", "watch"}, bytes).out,
              testing::AllOf(HasSubstr("x 10"), HasSubstr("y 20"), HasSubstr("z 30")));
}

// A table of numbers has one type for a column; text has none.
TEST(JoinedRecordings, EndANumPyTableWhereAChannelBecomesWider) {
  const auto bytes = packed("sample,x\n1,1\n") + packed("sample,x\n2,1000\n");
  const RuntimeDirectory directory;
  const auto array = probebox({"export", "-", "-o", directory.file("a.npy")}, bytes);
  EXPECT_EQ(array.status, 1);
  EXPECT_THAT(array.err, HasSubstr("row 1"));
  EXPECT_THAT(contentOf(directory.file("a.npy")), HasSubstr("'shape': (1,"));
  const auto text = probebox({"unpack", "-", "-"}, bytes);
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_EQ(text.out, "sample,x\n1,1\n2,1000\n");
}

TEST(JoinedRecordings, AreNotWholeWhereTheBoxWasRestartedWithinAStream) {
  const auto before = ofBoot(std::byte{1}, rows(0, 100)), after = ofBoot(std::byte{2}, rows(0, 50));
  EXPECT_EQ(probebox({"verify", "-"}, before + after).status, 0) << "each has its end";
  const auto found = probebox({"verify", "-", "--json"}, withoutEnd(before) + after);
  EXPECT_EQ(found.status, 1) << found.out;
  EXPECT_THAT(found.out, HasSubstr("restarted"));
  const auto exported = probebox({"unpack", "-", "-"}, withoutEnd(before) + after);
  EXPECT_EQ(exported.status, 1);
  EXPECT_THAT(exported.err, HasSubstr("not whole"));
}

TEST(JoinedRecordings, AreNotWholeWhereSamplesAreInThemTwice) {
  const auto repeated = [](const std::string& recording) {
    const auto found = probebox({"verify", "-", "--json"}, recording);
    return std::pair{found.status, found.objects().at(0)["repeated_samples"].get<int>()};
  };
  EXPECT_EQ(repeated(rows(0, 100) + rows(0, 100)), (std::pair{1, 100}));
  EXPECT_EQ(repeated(rows(0, 100) + rows(80, 200)), (std::pair{1, 20}));
  EXPECT_EQ(repeated(rows(0, 100) + rows(100, 200)), (std::pair{0, 0}));
  EXPECT_EQ(repeated(withoutEnd(rows(0, 100)) + rows(80, 200)), (std::pair{0, 0})) << "resumed";
  EXPECT_EQ(repeated(ofBoot(std::byte{1}, rows(0, 100)) + ofBoot(std::byte{2}, rows(0, 100))), (std::pair{0, 0}));
}

TEST(JoinedRecordings, AreNotWholeWhereALinkEndedAndTheNextBeganLater) {
  EXPECT_EQ(probebox({"verify", "-"}, rows(0, 100) + rows(150, 200)).status, 0) << "each has its end";
  EXPECT_EQ(probebox({"verify", "-"}, withoutEnd(rows(0, 100)) + rows(80, 200)).status, 0) << "resumed";
  const auto found = probebox({"verify", "-", "--json"}, withoutEnd(rows(0, 100)) + rows(150, 200));
  EXPECT_EQ(found.status, 1) << found.out;
  EXPECT_THAT(found.out, HasSubstr("50 samples"));
}

TEST(JoinedRecordings, AreNotWholeWithoutTheirBeginning) {
  const auto whole = underTwoDescriptors();
  ASSERT_EQ(probebox({"verify", "-"}, whole).status, 0);
  const auto found = probebox({"verify", "-", "--json"}, withoutFrames(whole, 6));  // up to the second DESCRIPTOR
  EXPECT_EQ(found.status, 1) << found.out;
  EXPECT_EQ(found.object()["received_samples"], 90);
  EXPECT_EQ(found.object()["lost_on_link_samples"], 90);
  EXPECT_THAT(found.out, HasSubstr("90 samples"));
}

TEST(JoinedRecordings, WithoutASampleAreWhole) {
  const auto verified = probebox({"verify", "-", "--json"}, withoutSamples());
  EXPECT_EQ(verified.status, 0) << verified.out;
  EXPECT_TRUE(verified.object()["end_known"]);
  EXPECT_EQ(probebox({"verify", "-"}, withoutSamples() + rows(100, 200)).status, 0);
  EXPECT_EQ(probebox({"verify", "-"}, rows(100, 200) + withoutSamples()).status, 0);
}

// Two hosts recorded one box; one of them lost something.
TEST(JoinedRecordings, HaveOneRowForASampleThatOneOfThemHas) {
  std::string table = "sample,x\n", holed = table;
  for (int k = 0; k < 1000; ++k) {
    const auto row = std::to_string(k) + "," + std::to_string(k % 100) + "\n";
    table += row;
    if (k < 600 || k >= 650) holed += row;
  }
  for (const auto& bytes : {packed(table) + packed(holed), packed(table) + packed(holed) + packed(table)}) {
    const auto joined = probebox({"unpack", "-", "-"}, bytes);
    EXPECT_EQ(joined.status, 0) << joined.err;
    EXPECT_EQ(joined.out, table);
    EXPECT_EQ(joined.err.find("missing"), std::string::npos) << joined.err;
  }
}

TEST(JoinedRecordings, CountTheRowsThatATableLeavesOut) {
  const auto repeated = [](const std::string& recording) {
    const RuntimeDirectory directory;
    const auto table = probebox({"unpack", "-", directory.file("t.csv"), "--json"}, recording);
    EXPECT_EQ(table.status, 0) << table.err;
    return std::pair{table.object()["rows"].get<int>(), table.object()["repeated_samples"].get<int>()};
  };
  EXPECT_EQ(repeated(rows(0, 100) + rows(80, 200)), (std::pair{200, 20}));
  EXPECT_EQ(repeated(rows(0, 100) + rows(100, 200)), (std::pair{200, 0}));
  const auto first = ofBoot(std::byte{1}, rows(0, 100)), second = ofBoot(std::byte{2}, rows(0, 50));
  EXPECT_EQ(repeated(first + second), (std::pair{150, 0}));
  EXPECT_EQ(repeated(first + second + first), (std::pair{150, 100})) << "the start of before";
  // Recordings in the wrong order: what comes behind later samples has no row, and is not called one that came twice.
  const auto outOfOrder = [](const std::string& recording) {
    const RuntimeDirectory directory;
    const auto table = probebox({"unpack", "-", directory.file("t.csv"), "--json"}, recording).object();
    return std::pair{table["out_of_order_samples"].get<int>(), table["repeated_samples"].get<int>()};
  };
  EXPECT_EQ(outOfOrder(rows(100, 200) + rows(0, 120)), (std::pair{100, 20}));
  EXPECT_EQ(outOfOrder(rows(0, 50) + rows(100, 150) + rows(40, 110)), (std::pair{50, 20})) << "into a gap";
}

TEST(JoinedRecordings, GiveEachRowTheScaleOfItsOwnBlock) {
  const auto exported = probebox({"export", "-", "-o", "-"}, fives(0, 100, 1) + fives(50, 100, 2));
  EXPECT_EQ(exported.status, 0) << exported.err;
  EXPECT_THAT(exported.out, HasSubstr("\n99,99000000,5,"));
  EXPECT_THAT(exported.out, HasSubstr("\n100,100000000,10,"));
  EXPECT_THAT(exported.out, HasSubstr("\n149,149000000,10,"));
}

}  // namespace
}  // namespace probebox::command
