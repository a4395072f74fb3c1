#include <chrono>
#include <cmath>
#include <cstring>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <thread>

#include "fake_box.hpp"
#include "host-tests/support/file_content.hpp"
#include "in_process.hpp"
#include "runtime_directory.hpp"
#include "tools/replay/recorded_stream.hpp"
#include "tools/replay/replay_box.hpp"

// Triggers on their way: watched, recorded, exported, served again. The fake box loses each seventh.
namespace probebox::command {
namespace {

using namespace std::chrono_literals;
using support::contentOf;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

std::vector<std::string> linesOf(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream in{text};
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

class Triggers : public testing::Test {
 protected:
  Finished record(const std::string& uri, const std::string& file, const std::string& seconds = "1") {
    return probebox({"-u", uri, "record", "-o", file, "--for", seconds, "--json"});
  }
  // The table of the triggers of a recording.
  std::string tableOf(const std::string& recording) {
    const auto table = directory_.file("triggers.csv");
    const auto exported =
        probebox({"export", recording, "-o", directory_.file("samples.csv"), "--triggers", table, "--force"});
    EXPECT_EQ(exported.status, 0) << exported.err;
    return contentOf(table);
  }

  RuntimeDirectory directory_;
  FakeBox box_{{.triggers = true}};
  std::string file_ = directory_.file("scan.pbx");
};

TEST_F(Triggers, AreWatchedAsObjectsOfTheirOwn) {
  const auto watched = probebox({"-u", box_.uri(), "watch", "--json", "--count", "3"});
  EXPECT_EQ(watched.status, 0) << watched.err;
  std::size_t triggers = 0;
  for (const auto& object : watched.objects()) {
    if (object.value("event", "") != "trigger") continue;
    ++triggers;
    const double number = object["number"].get<double>();
    EXPECT_EQ(object["line"], 1);
    EXPECT_EQ(object["line_sequence"], 2 * number);
    EXPECT_EQ(object["position_mm"][0], 0.5 * number);
    EXPECT_TRUE(object["position_mm"][1].is_null());
    EXPECT_EQ(object["correction_mm"], (std::vector{-0.0125, 0.0, 0.25}));
    EXPECT_EQ(object["tick_phase"], 0.25);
    EXPECT_EQ(object["at_ns"].get<std::int64_t>(), 5'000'250'000 + 1'000'000 * object["tick"].get<std::int64_t>());
    EXPECT_TRUE(object["correction_valid"]);
    EXPECT_EQ(object["sequence"], 9);
    EXPECT_TRUE(object["angle_deg"][0].is_null());
    EXPECT_NEAR(object["angle_deg"][2].get<double>(), 28.6478897565, 1e-9);
  }
  EXPECT_GT(triggers, 10U);
  EXPECT_THAT(probebox({"-u", box_.uri(), "watch", "--for", "0.5"}).out, testing::ContainsRegex("  trigger [0-9]+"));
}

TEST_F(Triggers, AreRecordedWithAnAccount) {
  const auto recorded = record(box_.uri(), file_);
  ASSERT_EQ(recorded.status, 0) << recorded.err;
  const auto sums = recorded.object();
  const auto received = sums["received_triggers"].get<std::size_t>();
  const auto lost = sums["declared_lost_triggers"].get<std::size_t>();
  EXPECT_GT(received, 20U);
  EXPECT_NEAR(static_cast<double>(lost), static_cast<double>(received) / 6, 1.5) << "each seventh";
  EXPECT_EQ(sums["lost_on_link_triggers"], 0);
  const auto verified = probebox({"verify", file_, "--json"});
  EXPECT_EQ(verified.status, 0) << verified.out;
  EXPECT_EQ(verified.object()["received_triggers"], received);
  EXPECT_EQ(verified.object()["declared_lost_triggers"], lost);
  EXPECT_EQ(linesOf(tableOf(file_)).size(), 1 + received);
  EXPECT_THAT(probebox({"-u", "file:" + file_, "watch", "--json"}).out, HasSubstr("\"event\":\"trigger\""));
}

TEST_F(Triggers, ResumeAfterALostLinkWithoutLosingOne) {
  const std::jthread cutter{[this](const std::stop_token& stop) {
    while (!stop.stop_requested() && !box_.streaming()) std::this_thread::sleep_for(5ms);
    std::this_thread::sleep_for(200ms);  // some triggers
    box_.cut();
  }};
  const auto recorded = record(box_.uri(), file_, "3");
  ASSERT_EQ(recorded.status, 0) << recorded.err;
  EXPECT_EQ(recorded.object()["reconnections"], 1);
  const auto rows = linesOf(tableOf(file_));
  ASSERT_GT(rows.size(), 20U);
  for (std::size_t k = 2; k < rows.size(); ++k) {
    const auto before = std::stoul(rows[k - 1]), number = std::stoul(rows[k]);
    EXPECT_EQ(number, before + (before % 7 == 6 ? 2 : 1));
  }
  EXPECT_EQ(probebox({"verify", file_}).status, 0);
}

TEST_F(Triggers, AreWrittenAsATableOfTheirOwn) {
  ASSERT_EQ(record(box_.uri(), file_).status, 0);
  const auto rows = linesOf(tableOf(file_));
  EXPECT_EQ(rows.at(0),
            "number,line,line_sequence,at_ns,tick,phase_q32,sigma_ns,clock_state,x_mm,y_mm,z_mm,correction_x_mm,"
            "correction_y_mm,correction_z_mm,correction_valid,correction_degraded,correction_sequence,"
            "a_deg,b_deg,c_deg");
  const auto number = std::stoul(rows.at(1));
  EXPECT_THAT(rows.at(1), testing::StartsWith(std::to_string(number) + ",1," + std::to_string(2 * number) + ","));
  EXPECT_THAT(rows.at(1), testing::HasSubstr(",,-100,-0.0125,0,0.25,1,0,9,,,28.64788"));
  const auto array = directory_.file("triggers.npy");
  ASSERT_EQ(probebox({"export", file_, "-o", directory_.file("s.csv"), "--triggers", array}).status, 0);
  const auto bytes = contentOf(array);
  const std::size_t header = 10 + static_cast<unsigned char>(bytes[8]) + 256U * static_cast<unsigned char>(bytes[9]);
  EXPECT_EQ(header % 64, 0U);
  EXPECT_THAT(bytes.substr(0, header), AllOf(HasSubstr("('number', '<u4')"), HasSubstr("('x_mm', '<f8')"),
                                             HasSubstr("'shape': (" + std::to_string(rows.size() - 1) + ",")));
  constexpr std::size_t kRow = 4 + 1 + 4 + 8 + 8 + 4 + 4 + 1 + 6 * 8 + 1 + 1 + 2 + 3 * 8;
  ASSERT_EQ(bytes.size(), header + (rows.size() - 1) * kRow);
  double x_mm = 0, y_mm = 0;
  std::memcpy(&x_mm, bytes.data() + header + 34, sizeof x_mm);
  std::memcpy(&y_mm, bytes.data() + header + 42, sizeof y_mm);
  EXPECT_EQ(x_mm, 0.5 * static_cast<double>(number));
  EXPECT_TRUE(std::isnan(y_mm)) << "nobody knows it";
}

TEST_F(Triggers, NeedAFileOfTheirOwn) {
  ASSERT_EQ(record(box_.uri(), file_).status, 0);
  const auto table = directory_.file("scan.csv");
  for (const auto& name :
       {std::string{"-"}, table, file_, directory_.file("./scan.csv"), directory_.file("./scan.pbx")}) {
    const auto refused = probebox({"export", file_, "-o", table, "--triggers", name, "--force"});
    EXPECT_EQ(refused.status, 2);
    EXPECT_THAT(refused.err, HasSubstr("triggers"));
  }
  EXPECT_THAT(probebox({"export", file_, "-o", table, "--triggers", ""}).err, HasSubstr("--triggers"));
  std::ofstream{directory_.file("there.csv")} << "kept";
  EXPECT_EQ(probebox({"export", file_, "-o", table, "--triggers", directory_.file("there.csv")}).status, 2);
  EXPECT_EQ(contentOf(directory_.file("there.csv")), "kept");
  EXPECT_THAT(probebox({"export", file_, "-o", table}).err, HasSubstr("--triggers FILE"));
}

// The same numbers as recorded, and nothing is lost that came before the recording.
TEST_F(Triggers, AreServedByAReplayAsTheyWereRecorded) {
  std::this_thread::sleep_for(100ms);  // some go by before it
  ASSERT_EQ(record(box_.uri(), file_).status, 0);
  auto recording = replay::RecordedStream::open(file_);
  auto listener = tcp::Listener::open({"127.0.0.1", 0});
  replay::ReplayBox replayed{std::move(recording).value(), std::move(listener).value(),
                             replay::ReplayOptions{.speed = 0, .once = false, .name = "scan.pbx"}};
  const std::jthread thread{[&](const std::stop_token& stop) {
    while (!stop.stop_requested() && replayed.round()) {
    }
  }};
  const auto again = directory_.file("again.pbx");
  const auto recorded = probebox({"-u", "tcp:127.0.0.1:" + std::to_string(replayed.address().port), "record", "-o",
                                  again, "--for", "2", "--json"});
  ASSERT_EQ(recorded.status, 0) << recorded.err;
  EXPECT_EQ(tableOf(again), tableOf(file_));
  const auto verified = probebox({"verify", file_, "--json"}).object();
  EXPECT_EQ(recorded.object()["received_triggers"], verified["received_triggers"]);
  EXPECT_EQ(recorded.object()["declared_lost_triggers"], verified["declared_lost_triggers"]);
}

}  // namespace
}  // namespace probebox::command
