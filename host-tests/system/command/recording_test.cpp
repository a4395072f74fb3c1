#include "tools/link/recording.hpp"

#include <chrono>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>
#include <thread>

#include "fake_box.hpp"
#include "host-tests/support/file_content.hpp"
#include "in_process.hpp"
#include "runtime_directory.hpp"

namespace probebox::command {
namespace {

using namespace std::chrono_literals;
using support::contentOf;
using testing::AllOf;
using testing::AnyOf;
using testing::HasSubstr;

std::vector<std::vector<double>> rowsOf(const std::string& csv) {
  std::istringstream lines{csv};
  std::string line;
  std::getline(lines, line);
  std::vector<std::vector<double>> rows;
  while (std::getline(lines, line)) {
    std::istringstream cells{line};
    auto& row = rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
  }
  return rows;
}

class Recording : public testing::Test {
 protected:
  Finished record(const std::string& seconds = "0.5") {
    return probebox({"-u", box_.uri(), "record", "-o", file_, "--for", seconds, "--json"});
  }

  // Until the recording has begun, or the command has ended without one.
  void waitForContent(const std::stop_token& stop) const {
    std::error_code absent;
    for (std::uintmax_t size = 0; size < 20'000 && !stop.stop_requested(); std::this_thread::sleep_for(5ms)) {
      size = std::filesystem::file_size(file_, absent);
      if (absent) size = 0;
    }
  }

  RuntimeDirectory directory_;
  FakeBox box_;
  std::string file_ = directory_.file("scan.pbx");
  std::string table_ = directory_.file("scan.csv");
};

TEST_F(Recording, AccountsForEverySample) {
  const auto recorded = record();
  EXPECT_EQ(recorded.status, 0) << recorded.err;
  const auto sums = recorded.object();
  EXPECT_GT(sums["received_samples"].get<int>(), 0);
  EXPECT_GT(sums["lost_at_source_samples"].get<int>(), 0) << "the fake box loses every tenth block";
  EXPECT_EQ(sums["produced_samples"].get<std::uint64_t>(), sums["received_samples"].get<std::uint64_t>() +
                                                               sums["declared_lost_samples"].get<std::uint64_t>() +
                                                               sums["lost_on_link_samples"].get<std::uint64_t>());
  EXPECT_TRUE(sums["balanced"]);
  EXPECT_TRUE(sums["end_known"]);
  EXPECT_EQ(sums["size_bytes"], contentOf(file_).size());
}

TEST_F(Recording, SaysTheEquationToPeople) {
  const auto recorded = probebox({"-u", box_.uri(), "record", "-o", file_, "--for", "0.3"});
  EXPECT_EQ(recorded.status, 0) << recorded.err;
  EXPECT_THAT(recorded.out, testing::ContainsRegex("produced [0-9]+ = received [0-9]+ \\+ declared lost [0-9]+"));
  EXPECT_THAT(recorded.out, HasSubstr("exact"));
}

TEST_F(Recording, ExportsOneRowForEachReceivedSample) {
  const auto sums = record().object();
  const auto exported = probebox({"export", file_, "-o", table_, "--json"});
  EXPECT_EQ(exported.status, 0) << exported.err;
  const auto summary = exported.object();
  EXPECT_EQ(summary["rows"], sums["received_samples"]);
  EXPECT_EQ(summary["missing_samples"], sums["declared_lost_samples"]);
  EXPECT_THAT(exported.err, HasSubstr("source_probe"));

  const auto csv = contentOf(table_);
  EXPECT_THAT(
      csv, testing::StartsWith("sample,time_ns,deflection_a_nm,x_um,flags,delay_result_id,tau_x_s,tau_y_s,tau_z_s\n"));
  const auto rows = rowsOf(csv);
  ASSERT_EQ(rows.size(), summary["rows"]);
  EXPECT_THAT(csv, testing::ContainsRegex("\n[0-9]+,[0-9]+,-[0-9]+,[0-9]+\\.[0-9][0-9][0-9],[01],[0-9]+,"));
  for (const auto& row : rows) {
    EXPECT_EQ(row[1], 5e9 + row[0] * 1e6);
    EXPECT_EQ(row[2], -row[0]);
    EXPECT_DOUBLE_EQ(row[3], row[0]);
  }
  for (const auto& gap : summary["gaps"]) {
    const auto first = gap["first_sample"].get<double>();
    for (const auto& row : rows) EXPECT_FALSE(row[0] >= first && row[0] < first + gap["count_samples"].get<double>());
  }
}

TEST_F(Recording, IsReadByTheCommandsThatReadABox) {
  const auto sums = record().object();
  const std::string uri = "file:" + file_;
  EXPECT_EQ(probebox({"-u", uri, "info", "--json"}).object()["board"],
            probebox({"-u", box_.uri(), "info", "--json"}).object()["board"]);

  const auto status = probebox({"-u", uri, "status", "--json"});
  EXPECT_EQ(status.status, 0) << status.err;
  EXPECT_EQ(status.object()["ledger"]["produced_samples"], sums["produced_samples"]);
  for (const auto* not_recorded : {"queue_high_water_events", "events", "modbus", "links", "procedure", "sources"})
    EXPECT_TRUE(status.object().at(not_recorded).is_null()) << not_recorded;
  for (const auto* not_recorded : {"frequency_ppb", "absolute_sigma_ns"})
    EXPECT_TRUE(status.object()["clock"].at(not_recorded).is_null()) << not_recorded;
  EXPECT_EQ(status.object()["clock"]["state"], "locked");
  EXPECT_EQ(status.object()["recording"], file_);
  EXPECT_EQ(status.object()["delay"]["calibrated"], false);
  const auto in_words = probebox({"-u", uri, "status"}).out;
  EXPECT_THAT(in_words, AllOf(HasSubstr(file_), HasSubstr(" produced, "), testing::Not(HasSubstr("modbus")),
                              testing::Not(HasSubstr("ppm"))));

  const auto watched = probebox({"-u", uri, "watch", "--json"});
  EXPECT_EQ(watched.status, 0) << watched.err;
  const auto last = watched.objects().back();
  EXPECT_EQ(last["ledger"]["produced_samples"], sums["produced_samples"]);
  EXPECT_EQ(last["ledger"]["balanced"], true);
  // What comes after the last sample is declared lost.
  const auto after_last = sums["next_sample"].get<std::int64_t>() - last["sample"].get<std::int64_t>() - 1;
  EXPECT_GE(after_last, 0);
  EXPECT_LE(after_last, sums["declared_lost_samples"].get<std::int64_t>());
  EXPECT_EQ(probebox({"-u", uri, "watch", "--json", "--count", "2"}).objects().size(), 2U);

  EXPECT_EQ(probebox({"-u", uri, "verify"}).status, 0);
  EXPECT_EQ(probebox({"-u", uri, "export", "-o", table_, "--json"}).object()["rows"], sums["received_samples"]);

  const auto copy = directory_.file("copy.pbx");
  const auto copied = probebox({"-u", uri, "record", "-o", copy, "--json"});
  EXPECT_EQ(copied.status, 0) << copied.err;
  for (const auto* key : {"produced_samples", "received_samples", "declared_lost_samples", "next_sample", "end_known"})
    EXPECT_EQ(copied.object()[key], sums[key]) << key;
  EXPECT_EQ(contentOf(copy), contentOf(file_)) << "all frames are good";
  EXPECT_EQ(probebox({"-u", uri, "record", "-o", file_, "--force"}).status, 2) << "onto itself";
  EXPECT_EQ(probebox({"verify"}).status, 2) << "of what?";
}

// What is damaged is left out of a copy, and the account tells.
TEST_F(Recording, IsCopiedWithoutItsDamage) {
  const auto sums = record().object();
  auto bytes = contentOf(file_);
  bytes[bytes.size() / 2] ^= 0x55;
  std::ofstream{file_, std::ios::binary} << bytes;
  const auto copy = directory_.file("copy.pbx");
  const auto copied = probebox({"-u", "file:" + file_, "record", "-o", copy, "--json"});
  EXPECT_EQ(copied.status, 0) << copied.err;
  const auto told = copied.object();
  EXPECT_EQ(told["produced_samples"], sums["produced_samples"]);
  EXPECT_EQ(told["received_samples"].get<int>() + told["declared_lost_samples"].get<int>() +
                told["lost_on_link_samples"].get<int>(),
            sums["produced_samples"].get<int>());
  EXPECT_LT(contentOf(copy).size(), bytes.size());
}

// A link whose beginning cannot be read was not made anew.
TEST_F(Recording, CountsNoReconnectionWithoutABeginning) {
  record();
  auto bytes = contentOf(file_);
  bytes[5] ^= 0x55;  // in the first frame, WELCOME
  std::ofstream{file_, std::ios::binary} << bytes;
  const auto copied = probebox({"-u", "file:" + file_, "record", "-o", directory_.file("copy.pbx"), "--json"});
  EXPECT_EQ(copied.object()["reconnections"], 0) << copied.err;
  const auto watched = probebox({"-u", "file:" + file_, "watch", "--json"});
  ASSERT_FALSE(watched.objects().empty()) << watched.err;
  EXPECT_EQ(watched.objects().back()["reconnections"], 0);
}

TEST_F(Recording, IsCopiedAsItIs) {
  record();
  for (const auto& [option, value] : {std::pair{"--profile", "raw"}, {"--policy", "live"}, {"--patience", "5"}}) {
    const auto refused = probebox({"-u", "file:" + file_, "record", "-o", directory_.file("copy.pbx"), option, value});
    EXPECT_EQ(refused.status, 2);
    EXPECT_THAT(refused.err, AllOf(HasSubstr(option), HasSubstr("a box")));
  }
}

TEST_F(Recording, IsReadUntilCtrlC) {
  record();
  const std::atomic<bool> interrupted{true};
  const auto ends = [&](std::vector<std::string> arguments) { return probebox(arguments, {}, &interrupted).status; };
  const std::string uri = "file:" + file_;
  EXPECT_EQ(ends({"-u", uri, "record", "-o", directory_.file("copy.pbx")}), 130);
  for (const auto* question : {"info", "status", "watch", "verify"}) EXPECT_EQ(ends({"-u", uri, question}), 130);
  EXPECT_EQ(ends({"export", file_, "-o", table_}), 130);
}

// Whoever wants one update of a pipe does not want all of it.
TEST_F(Recording, IsWatchedNoFurtherThanItWasWanted) {
  record();
  std::string bytes;
  while (bytes.size() < 300'000) bytes += contentOf(file_);
  std::istringstream in{bytes};
  std::ostringstream out, err;
  const std::atomic<bool> never{false};
  const std::vector<std::string> words{"-u", "file:-", "watch", "--json", "--count", "1"};
  const auto status = run(words, {in, out, err, false, false, 0, never});
  EXPECT_EQ(status, ExitStatus::ok) << err.str();
  EXPECT_TRUE(in.good());
  EXPECT_LT(static_cast<std::size_t>(in.tellg()), bytes.size() / 2);
}

TEST_F(Recording, GoesThroughPipesAsWell) {
  const auto recorded = probebox({"-u", box_.uri(), "record", "-o", "-", "--for", "0.3", "--json"});
  EXPECT_EQ(recorded.status, 0);
  EXPECT_TRUE(nlohmann::ordered_json::parse(recorded.err)["balanced"])
      << "the summary leaves the standard output to the data";
  const auto exported = probebox({"export", "-", "-o", "-"}, recorded.out);
  EXPECT_EQ(exported.status, 0) << exported.err;
  EXPECT_THAT(exported.out, testing::StartsWith("sample,time_ns,"));
  EXPECT_EQ(rowsOf(exported.out).size(), nlohmann::ordered_json::parse(recorded.err)["received_samples"]);
}

TEST_F(Recording, ResumesAfterALostLinkWithoutLosingASample) {
  std::jthread cutter{[this](const std::stop_token& stop) {
    waitForContent(stop);
    for (int i = 0; i < 2; ++i) {
      box_.cut();
      std::this_thread::sleep_for(400ms);
    }
  }};
  const auto recorded = record("2");
  EXPECT_EQ(recorded.status, 0) << recorded.err << recorded.out;
  const auto sums = recorded.object();
  EXPECT_GE(sums["reconnections"].get<int>(), 1);
  EXPECT_TRUE(sums["balanced"]);
  EXPECT_EQ(sums["lost_in_queue_samples"], 0) << "the box keeps the last seconds";
  const auto exported = probebox({"export", file_, "-o", table_, "--json"});
  EXPECT_EQ(exported.object()["rows"], sums["received_samples"]) << "repeated samples have one row";
}

TEST_F(Recording, EndsInOrderAtCtrlC) {
  std::atomic<bool> interrupted{false};
  std::jthread person{[&](const std::stop_token& stop) {
    waitForContent(stop);
    interrupted = true;
  }};
  const auto recorded = probebox({"-u", box_.uri(), "record", "-o", file_, "--json"}, {}, &interrupted);
  EXPECT_EQ(recorded.status, 130);
  EXPECT_TRUE(recorded.object()["balanced"]);
  EXPECT_TRUE(recorded.object()["end_known"]);
  EXPECT_EQ(probebox({"export", file_, "-o", table_}).status, 0);
}

TEST_F(Recording, CanBeReadHoweverItWasCut) {
  record("0.3");
  const auto whole = contentOf(file_);
  const auto all_rows = rowsOf(probebox({"export", "-", "-o", "-"}, whole).out).size();
  for (std::size_t part = 1; part < 20; ++part) {
    const auto size = whole.size() * part / 20;
    const auto exported = probebox({"export", "-", "-o", "-"}, whole.substr(0, size));
    EXPECT_LE(rowsOf(exported.out).size(), all_rows);
    if (exported.status == 2) {  // a busy computer records little, and the first parts end within the descriptor
      EXPECT_THAT(exported.err, HasSubstr("channels"));
      EXPECT_LT(part, 10U);
      continue;
    }
    EXPECT_EQ(exported.status, 1) << exported.err;
    EXPECT_THAT(exported.err, HasSubstr("not whole"));
    EXPECT_THAT(exported.err, AnyOf(HasSubstr("are unknown"), HasSubstr("a frame")));
  }
}

TEST_F(Recording, IsExportedWithStatus1WhenItIsDamaged) {
  record("0.3");
  auto damaged = contentOf(file_);
  auto& byte = damaged[damaged.size() / 2];
  byte = static_cast<char>(byte ^ (byte == 0x10 ? 0x20 : 0x10));  // 0 would end the frame, and damage two
  for (const std::vector<std::string>& command :
       {std::vector<std::string>{"export", "-", "-o", "-"}, {"unpack", "-", "-"}}) {
    const auto exported = probebox(command, damaged);
    EXPECT_EQ(exported.status, 1);
    EXPECT_THAT(exported.err, AllOf(HasSubstr("not whole"), HasSubstr("1 frame")));
    EXPECT_GT(rowsOf(exported.out).size(), 10U) << "what can be read is there";
  }
}

// A serial line may still carry what the host before it was told.
TEST_F(Recording, LosesNoRowToAHeartbeatOfAnEarlierStream) {
  record("0.3");
  const auto whole = contentOf(file_);
  const auto rows = rowsOf(probebox({"export", "-", "-o", "-"}, whole).out);
  std::ostringstream stray;
  link::RecordingWriter writer{stray};
  messages::Heartbeat beat;
  beat.streaming = true;
  beat.stream_number = 3;
  beat.position = {1'000'000'000};
  beat.produced = beat.sent_samples = 1'000'000'000;
  const auto payload = messages::encoded(beat);
  writer.write({{.type = static_cast<std::uint8_t>(messages::MessageType::heartbeat),
                 .payload_length = static_cast<std::uint16_t>(payload.size())},
                payload});
  const auto exported = probebox({"export", "-", "-o", "-"}, stray.str() + whole);
  EXPECT_EQ(exported.status, 0) << exported.err;
  EXPECT_EQ(rowsOf(exported.out), rows);
  const auto verified = probebox({"verify", "-", "--json"}, stray.str() + whole);
  EXPECT_EQ(verified.status, 0) << verified.out;
  EXPECT_EQ(verified.object()["stray_frames"], 1);
}

TEST_F(Recording, OverwritesNothingUnlessToldTo) {
  std::ofstream{file_} << "precious";
  const auto refused = record();
  EXPECT_EQ(refused.status, 2);
  EXPECT_THAT(refused.err, AllOf(HasSubstr(file_), HasSubstr("--force")));
  EXPECT_EQ(contentOf(file_), "precious");
  EXPECT_EQ(probebox({"-u", box_.uri(), "record", "-o", file_, "--for", "0.2", "--force"}).status, 0);
  std::ofstream{table_} << "precious";
  EXPECT_EQ(probebox({"export", file_, "-o", table_}).status, 2);
  EXPECT_EQ(contentOf(table_), "precious");
}

TEST_F(Recording, ShowsItsBox) {
  record("0.2");
  EXPECT_THAT(probebox({"-u", "file:" + file_, "info"}).out, HasSubstr("F-0001"));
}

TEST_F(Recording, LeavesNoFileWhenThereIsNoBox) {
  const auto failed = probebox({"-u", "tcp:127.0.0.1:1", "record", "-o", file_, "--for", "1"});
  EXPECT_EQ(failed.status, 3);
  EXPECT_FALSE(std::filesystem::exists(file_));
}

TEST_F(Recording, NamesADirectoryThatIsNotThere) {
  const auto failed = probebox({"-u", box_.uri(), "record", "-o", directory_.file("absent/scan.pbx"), "--for", "1"});
  EXPECT_EQ(failed.status, 2);
  EXPECT_THAT(failed.err, HasSubstr("absent/scan.pbx"));
}

TEST(Exporting, RefusesWhatIsNoRecording) {
  const RuntimeDirectory directory;
  const auto absent = probebox({"export", directory.file("absent.pbx"), "-o", "-"});
  EXPECT_EQ(absent.status, 2);
  EXPECT_THAT(absent.err, HasSubstr("absent.pbx"));
  const auto garbage = probebox({"export", "-", "-o", "-", "--json"}, std::string(10'000, 'x'));
  EXPECT_EQ(garbage.status, 2);
  EXPECT_THAT(garbage.err, HasSubstr("no frame"));
  EXPECT_EQ(probebox({"export", "-", "-o", "-"}, "").status, 2);
}

TEST(Exporting, LeavesAnOlderTableAloneWhenTheRecordingCannotBeRead) {
  const RuntimeDirectory directory;
  const auto bad = directory.file("bad.pbx"), table = directory.file("scan.csv");
  for (const std::string& content : {std::string{}, std::string(10'000, 'x')}) {
    std::ofstream{bad} << content;
    EXPECT_EQ(probebox({"export", bad, "-o", table}).status, 2);
    EXPECT_FALSE(std::filesystem::exists(table));
    std::ofstream{table} << "precious";
    EXPECT_EQ(probebox({"export", bad, "-o", table, "--force"}).status, 2);
    EXPECT_EQ(contentOf(table), "precious");
    std::filesystem::remove(table);
  }
}

TEST(Exporting, NeverWritesOverItsOwnInput) {
  const RuntimeDirectory directory;
  const auto file = directory.file("scan.pbx");
  std::ofstream{file} << "precious";
  EXPECT_EQ(probebox({"export", file, "-o", file, "--force"}).status, 2);
  EXPECT_EQ(contentOf(file), "precious");
}

}  // namespace
}  // namespace probebox::command
