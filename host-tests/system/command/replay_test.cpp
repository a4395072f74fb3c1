#include <atomic>
#include <cstdlib>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>
#include <thread>

#include "host-tests/support/file_content.hpp"
#include "in_process.hpp"
#include "runtime_directory.hpp"
#include "tools/replay/recorded_stream.hpp"
#include "tools/replay/replay_box.hpp"

namespace probebox::command {
namespace {

using support::contentOf;
using testing::HasSubstr;

std::string table(int rows) {
  std::ostringstream text;
  text << "sample,x_nm,flags\n";
  for (int k = 0; k < rows; ++k) {
    if (k % 500 == 200) continue;
    text << 1000 + k << ',' << 70'000LL * k + k % 13 << ',' << k % 3 << '\n';
  }
  return text.str();
}

// The recording as a box, in a thread.
class Replayed {
 public:
  Replayed(const std::string& file, double speed) {
    auto recording = replay::RecordedStream::open(file);
    auto listener = tcp::Listener::open({"127.0.0.1", 0});
    box_ =
        std::make_unique<replay::ReplayBox>(std::move(recording).value(), std::move(listener).value(),
                                            replay::ReplayOptions{.speed = speed, .once = false, .name = "scan.pbx"});
    thread_ = std::jthread{[this](const std::stop_token& stop) {
      while (!stop.stop_requested() && box_->round()) {
      }
    }};
  }
  std::uint16_t port() const { return box_->address().port; }
  std::string uri() const { return "tcp:127.0.0.1:" + std::to_string(port()); }

 private:
  std::unique_ptr<replay::ReplayBox> box_;
  std::jthread thread_;
};

class Replaying : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream{csv_} << table(3000);
    ASSERT_EQ(probebox({"pack", csv_, file_}).status, 0);
  }
  RuntimeDirectory directory_;
  std::string csv_ = directory_.file("scan.csv");
  std::string file_ = directory_.file("scan.pbx");
  std::string again_ = directory_.file("again.pbx");
};

TEST_F(Replaying, GivesEveryHostTheSameSamplesInEveryProfile) {
  for (const auto* profile : {"auto", "raw", "fast", "tight"}) {
    const Replayed box{file_, 0};
    const auto recorded =
        probebox({"-u", box.uri(), "record", "-o", again_, "--for", "1", "--profile", profile, "--force", "--json"});
    ASSERT_EQ(recorded.status, 0) << recorded.err;
    EXPECT_TRUE(recorded.object()["balanced"]);
    EXPECT_EQ(recorded.object()["lost_at_source_samples"], 6) << "what the recording lacks";
    EXPECT_EQ(probebox({"unpack", again_, "-"}).out, contentOf(csv_)) << profile;
    const auto verified = probebox({"verify", again_, "--json"});
    EXPECT_EQ(verified.status, 0) << verified.out;
  }
}

TEST_F(Replaying, KeepsTheRecordedPace) {
  std::ofstream{csv_} << table(30'000);
  ASSERT_EQ(probebox({"pack", csv_, file_, "--force"}).status, 0);
  const Replayed box{file_, 1};  // 1 ms a sample
  const auto sums = probebox({"-u", box.uri(), "record", "-o", again_, "--for", "2", "--json"}).object();
  EXPECT_GT(sums["received_samples"].get<int>(), 0);
  EXPECT_LT(sums["produced_samples"].get<int>(), 20'000) << "the whole of it takes 30 s";
}

// The first block of the recording comes after 256 ms.
TEST_F(Replaying, IsRecordedAlsoBeforeItsFirstSample) {
  const Replayed box{file_, 1};
  const auto recorded = probebox({"-u", box.uri(), "record", "-o", again_, "--for", "0.02", "--json"});
  EXPECT_EQ(recorded.status, 0) << recorded.err << recorded.out;
  EXPECT_TRUE(recorded.object()["end_known"]);
  EXPECT_TRUE(recorded.object()["balanced"]);
  const auto verified = probebox({"verify", again_, "--json"});
  EXPECT_EQ(verified.status, 0) << verified.out;
}

TEST_F(Replaying, AnswersAsABoxAndRefusesByNameWhatAsksForAMeasurement) {
  const Replayed box{file_, 1};
  const auto status = probebox({"-u", box.uri(), "status", "--json"});
  ASSERT_EQ(status.status, 0) << status.err;
  EXPECT_THAT(status.out, HasSubstr("replay: scan.pbx"));
  const auto info = probebox({"-u", box.uri(), "info"});
  EXPECT_THAT(info.out, HasSubstr("of table"));
  const auto calibrate = probebox({"-u", box.uri(), "calibrate", "delay-multi-speed"});
  EXPECT_EQ(calibrate.status, 4);
  EXPECT_THAT(calibrate.err, HasSubstr("recording"));
}

TEST_F(Replaying, AnswersWhileAHostSendsWithoutPause) {
  const Replayed box{file_, 1};
  auto sender = tcp::connectTcp({"127.0.0.1", box.port()}, std::chrono::seconds{5});
  ASSERT_TRUE(sender);
  std::atomic<std::size_t> sent{0};
  const std::jthread sending{[&](const std::stop_token& stop) {
    const std::vector<std::byte> zeros(1'000'000);
    while (!stop.stop_requested()) sent += sender.value()->write(zeros).bytes;
  }};
  while (sent < 10'000'000) std::this_thread::yield();
  const auto status = probebox({"-u", box.uri(), "status"});
  EXPECT_EQ(status.status, 0) << status.err;
}

// What is missing in the recording looks like losses of the box to hosts.
TEST_F(Replaying, SaysAtItsEndThatTheRecordingIsDamaged) {
  const auto whole = contentOf(file_);
  auto damaged = whole;
  auto& byte = damaged[damaged.size() / 2];
  byte = static_cast<char>(byte ^ (byte == 0x10 ? 0x20 : 0x10));  // 0 would end the frame, and damage two
  for (const auto& [content, fault] :
       {std::pair{whole, ""}, std::pair{damaged, "1 frame is damaged; 1 frame is missing"},
        std::pair{whole.substr(0, whole.size() - 300), "it ends before its stream did"}}) {
    std::ofstream{file_} << content;
    const auto port = tcp::Listener::open({"127.0.0.1", 0})->address().port;
    const auto address = "127.0.0.1:" + std::to_string(port);
    Finished replayed;
    {
      const std::jthread serving{[&] {
        replayed = probebox({"replay", file_, "--listen", address, "--speed", "max", "--once"});
      }};
      while (probebox({"-u", "tcp:" + address, "status"}).status != 0) std::this_thread::yield();
      EXPECT_EQ(probebox({"-u", "tcp:" + address, "record", "-o", again_, "--for", "0.5", "--force"}).status, 0);
    }
    EXPECT_EQ(replayed.status, *fault == 0 ? 0 : 1) << replayed.err;
    EXPECT_THAT(replayed.err, HasSubstr(fault));
  }
}

TEST_F(Replaying, RefusesWhatIsNoRecording) {
  std::ofstream{again_} << "sample,x\n1,2\n";
  EXPECT_EQ(probebox({"replay", again_}).status, 2);
  EXPECT_EQ(probebox({"replay", directory_.file("absent.pbx")}).status, 2);
  EXPECT_EQ(probebox({"replay", file_, "--listen", "nonsense"}).status, 2);
  EXPECT_EQ(probebox({"replay", file_, "--speed", "0"}).status, 2);
}

// The array's bytes against the table, and numpy's own reading of them where numpy is.
TEST_F(Replaying, ExportsForNumPy) {
  const auto array = directory_.file("scan.npy");
  const auto exported = probebox({"export", file_, "-o", array});
  ASSERT_EQ(exported.status, 0) << exported.err;
  const auto bytes = contentOf(array);
  EXPECT_EQ(bytes.substr(1, 5), "NUMPY");
  const std::size_t header = 10 + static_cast<unsigned char>(bytes[8]) + 256U * static_cast<unsigned char>(bytes[9]);
  EXPECT_EQ(header % 64, 0U);
  EXPECT_THAT(bytes.substr(0, header),
              HasSubstr("('sample', '<i8'), ('time_ns', '<i8'), ('x_nm', '<u4'), ('flags', '|u1')"));
  constexpr std::size_t kRow = 8 + 8 + 4 + 1 + 8 + 3 * 8;
  EXPECT_EQ((bytes.size() - header) % kRow, 0U);
  EXPECT_EQ((bytes.size() - header) / kRow, 2994U);
  EXPECT_EQ(probebox({"export", file_, "-o", array}).status, 2) << "nothing is overwritten";
  if (std::system("python3 -c 'import numpy' 2>/dev/null") != 0) GTEST_SKIP() << "python3-numpy is not installed";
  const std::string check = "python3 -c \"import numpy; a = numpy.load('" + array +
                            "', allow_pickle=False); assert len(a) == 2994 and a['sample'][-1] == 3999 and "
                            "a['x_nm'][1] == 70001 and a['delay_result_id'].max() == 0\"";
  EXPECT_EQ(std::system(check.c_str()), 0);
}

class Verifying : public Replaying {};

TEST_F(Verifying, SaysWholeOrWhereTheFault) {
  EXPECT_EQ(probebox({"verify", file_}).status, 0);
  const auto whole = contentOf(file_);
  const auto cut = probebox({"verify", "-", "--json"}, whole.substr(0, whole.size() - 300));
  EXPECT_EQ(cut.status, 1);
  EXPECT_FALSE(cut.object()["whole"]);
  EXPECT_THAT(cut.out, HasSubstr("at byte"));
  EXPECT_FALSE(cut.object()["end_known"]);
  auto damaged = whole;
  damaged[damaged.size() / 2] ^= 0x20;
  const auto found = probebox({"verify", "-", "--json"}, damaged);
  EXPECT_EQ(found.status, 1);
  EXPECT_EQ(found.object()["damaged_frames"], 1);
  EXPECT_EQ(found.object()["missing_frames"], 1);
  EXPECT_GT(found.object()["lost_on_link_samples"].get<int>(), 0);
  EXPECT_EQ(found.object()["unbalanced_heartbeats"], 0) << "what is missing is known";
  EXPECT_EQ(probebox({"verify", "-"}, "no recording").status, 2);
}

}  // namespace
}  // namespace probebox::command
