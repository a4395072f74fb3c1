#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>

#include "host-tests/support/file_content.hpp"
#include "in_process.hpp"
#include "runtime_directory.hpp"
#include "tools/link/recording_maker.hpp"

// Recordings joined by `cat`, whose channels change in the middle.
namespace probebox::command {
namespace {

using support::contentOf;
using testing::HasSubstr;

std::string packed(const std::string& table) {
  const auto done = probebox({"pack", "-", "-"}, table);
  EXPECT_EQ(done.status, 0) << done.err;
  return done.out;
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
  EXPECT_THAT(probebox({"-u", "file:-", "watch"}, bytes).out, HasSubstr("x 10 y 20 z 30 nm"));
}

// A table of numbers has one type for a column; text has none.
TEST(JoinedRecordings, EndANumPyTableWhereAChannelBecomesWider) {
  const auto bytes = packed("sample,x\n1,1\n") + packed("sample,x\n2,1000\n");
  const RuntimeDirectory directory;
  const auto array = probebox({"export", "-", "-o", directory.file("a.npy")}, bytes);
  EXPECT_EQ(array.status, 1);
  EXPECT_THAT(array.err, HasSubstr("changed its channels after row 1"));
  EXPECT_THAT(contentOf(directory.file("a.npy")), HasSubstr("'shape': (1,"));
  const auto text = probebox({"unpack", "-", "-"}, bytes);
  EXPECT_EQ(text.status, 0) << text.err;
  EXPECT_EQ(text.out, "sample,x\n1,1\n2,1000\n");
}

}  // namespace
}  // namespace probebox::command
