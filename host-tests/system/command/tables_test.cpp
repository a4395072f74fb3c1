#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <random>
#include <sstream>

#include "host-tests/support/file_content.hpp"
#include "in_process.hpp"
#include "runtime_directory.hpp"

// pack, unpack and clock: files in, files out.
namespace probebox::command {
namespace {

using support::contentOf;
using testing::AllOf;
using testing::HasSubstr;

// Rows of a scan, of jumps over the whole range, of what stands still; with gaps.
std::string anyTable(std::uint64_t seed, int rows) {
  std::mt19937_64 random{seed};
  std::ostringstream text;
  text << "sample,x_nm,wild,small,still_um_per_s,edge_ns\n";
  std::int64_t sample = static_cast<std::int64_t>(random() % 1000);
  for (int k = 0; k < rows; ++k) {
    text << sample << ',' << 1'000'000 + 250 * k + static_cast<int>(random() % 60) << ','
         << static_cast<std::int64_t>(random()) << ',' << static_cast<int>(random() % 5) - 2 << ",-7,"
         << (k % 2 == 0 ? std::numeric_limits<std::int64_t>::min() : std::numeric_limits<std::int64_t>::max()) << '\n';
    sample += random() % 50 == 0 ? static_cast<std::int64_t>(random() % 90) + 1 : 1;
  }
  return text.str();
}

TEST(Packing, GivesBackTheSameTableBitForBit) {
  for (const auto* profile : {"raw", "fast", "tight"}) {
    for (const auto* frame : {"1", "7", "256", "2048"}) {
      const auto table = anyTable(3, 700);
      const auto packed = probebox({"pack", "--profile", profile, "--frame", frame, "-", "-"}, table);
      ASSERT_EQ(packed.status, 0) << packed.err;
      const auto unpacked = probebox({"unpack", "-", "-"}, packed.out);
      ASSERT_EQ(unpacked.status, 0) << unpacked.err;
      EXPECT_EQ(unpacked.out, table) << profile << " " << frame;
      EXPECT_EQ(probebox({"export", "-", "-o", "-"}, packed.out).status, 0);
    }
  }
}

TEST(Packing, TellsGapsByTheirPlaces) {
  const auto packed = probebox({"pack", "-", "-", "--json"}, "sample,x\n5,1\n6,1\n9,2\n10,2\n");
  EXPECT_EQ(nlohmann::ordered_json::parse(packed.err)["missing_samples"], 2);
  const auto unpacked = probebox({"unpack", "-", "-", "--json"}, packed.out);
  const auto summary = nlohmann::ordered_json::parse(unpacked.err.substr(unpacked.err.find('{')));
  ASSERT_EQ(summary["gaps"].size(), 1U);
  EXPECT_EQ(summary["gaps"][0]["first_sample"], 7);
  EXPECT_EQ(summary["gaps"][0]["count_samples"], 2);
  EXPECT_TRUE(summary["end_known"]);
}

TEST(Packing, LeavesItsInputAsItIs) {
  RuntimeDirectory directory;
  const auto table = directory.file("s.csv"), edges = directory.file("e.csv");
  const auto content = [](const std::string& path) {
    std::ostringstream text;
    text << std::ifstream{path}.rdbuf();
    return text.str();
  };
  std::ofstream{table} << "sample,x\n5,1\n6,1\n";
  std::ofstream{edges} << "edge_ns\n1000000\n2000000\n";
  const auto packed = probebox({"pack", table, table, "--force"});
  EXPECT_EQ(packed.status, 2);
  EXPECT_THAT(packed.err, AllOf(HasSubstr("s.csv"), HasSubstr("itself")));
  EXPECT_EQ(content(table), "sample,x\n5,1\n6,1\n");
  const auto judged = probebox({"clock", "--period-ns", "1000000", edges, edges, "--force"});
  EXPECT_EQ(judged.status, 2);
  EXPECT_THAT(judged.err, AllOf(HasSubstr("e.csv"), HasSubstr("themselves")));
  EXPECT_EQ(content(edges), "edge_ns\n1000000\n2000000\n");
  EXPECT_THAT(probebox({"pack", table, ""}).err, HasSubstr("is empty"));
}

TEST(Exporting, WritesNoTableUnderTheNameOfAnotherFormat) {
  RuntimeDirectory directory;
  const auto recording = directory.file("scan.pbx");
  std::ofstream{recording} << probebox({"pack", "-", "-"}, "sample,x\n5,1\n6,1\n").out;
  for (const std::string name : {"scan.mat", "scan.xlsx", "scan.parquet"}) {
    const auto refused = probebox({"export", recording, "-o", directory.file(name)});
    EXPECT_EQ(refused.status, 2);
    EXPECT_THAT(refused.err, AllOf(HasSubstr(".csv"), HasSubstr(".npy"), HasSubstr(".mcap"), HasSubstr(name)));
    EXPECT_FALSE(std::filesystem::exists(directory.file(name)));
    EXPECT_EQ(probebox({"export", recording, "-o", "-", "--triggers", directory.file(name)}).status, 2);
  }
  for (const std::string name : {"scan.csv", "scan.npy", "scan"})
    EXPECT_EQ(probebox({"export", recording, "-o", directory.file(name)}).status, 0) << name;
  EXPECT_EQ(probebox({"export", recording, "-o", "/dev/null"}).status, 0);
}

TEST(Packing, FastIsSmallerThanRawAndTightThanFast) {
  std::ostringstream table;
  table << "sample,x_nm,flags\n";
  for (int k = 0; k < 5000; ++k) table << k << ',' << 1'000'000'000 + 60'000LL * k + k % 7 << ",4\n";
  const auto size = [&](const char* profile) {
    return probebox({"pack", "--profile", profile, "-", "-"}, table.str()).out.size();
  };
  EXPECT_LT(3 * size("fast"), size("raw"));
  EXPECT_LT(size("tight"), size("fast"));
}

TEST(Packing, NamesLineAndColumnOfWhatItCannotTake) {
  const auto complaint = [](const std::string& table) {
    const auto refused = probebox({"pack", "-", "-"}, table);
    EXPECT_EQ(refused.status, 2);
    EXPECT_TRUE(refused.out.empty());
    return refused.err;
  };
  EXPECT_THAT(complaint(""), HasSubstr("empty"));
  EXPECT_THAT(complaint("x,y\n1,2\n"), AllOf(HasSubstr("line 1"), HasSubstr("sample")));
  EXPECT_THAT(complaint("sample\n1\n"), HasSubstr("beside sample"));
  EXPECT_THAT(complaint("sample,x,x\n1,2,3\n"), HasSubstr("called x"));
  EXPECT_THAT(complaint("sample,,x\n1,2,3\n"), HasSubstr("column 2"));
  EXPECT_THAT(complaint("sample,x\n"), HasSubstr("no row"));
  EXPECT_THAT(complaint("sample,x\n1,2\n2,1.5\n"), AllOf(HasSubstr("line 3"), HasSubstr("column x"), HasSubstr("1.5")));
  EXPECT_THAT(complaint("sample,x\n1,2\n2,\n"), AllOf(HasSubstr("line 3"), HasSubstr("column x")));
  EXPECT_THAT(complaint("sample,x\n1,9223372036854775808\n"), HasSubstr("64 bits"));
  EXPECT_THAT(complaint("sample,x\n1,2,3\n"), HasSubstr("3 values"));
  EXPECT_THAT(complaint("sample,x\n1,2"), HasSubstr("last line"));
  EXPECT_THAT(complaint("sample,x\n1,2\n2,"), HasSubstr("last line"));
  EXPECT_THAT(complaint("sample,x\n1,2\n1,2\n"), AllOf(HasSubstr("line 3"), HasSubstr("come after")));
}

TEST(Packing, TakesTheByteOrderMarkOfASpreadsheet) {
  const auto packed = probebox({"pack", "-", "-"}, "\xEF\xBB\xBFsample,x\r\n5,1\r\n\r\n");
  ASSERT_EQ(packed.status, 0) << packed.err;
  EXPECT_EQ(probebox({"unpack", "-", "-"}, packed.out).out, "sample,x\n5,1\n");
}

TEST(Packing, RefusesNamesThatNoRecordingHolds) {
  const auto complaint = [](const std::string& names) {
    std::string values = "1";
    for (const char c : names) values += c == ',' ? ",2" : "";
    const auto refused = probebox({"pack", "-", "-"}, names + "\n" + values + "\n");
    EXPECT_EQ(refused.status, 2);
    EXPECT_TRUE(refused.out.empty());
    return refused.err;
  };
  EXPECT_THAT(complaint("sample," + std::string(70'000, 'x')), AllOf(HasSubstr("column 2"), HasSubstr("70000")));
  EXPECT_THAT(complaint("sample,a\x1b[2J"), AllOf(HasSubstr("column 2"), HasSubstr("control character")));
  EXPECT_THAT(complaint("sample,a\u202Eb"), HasSubstr("direction"));
  std::string many = "sample";
  for (int k = 0; k < 200; ++k) many += "," + std::to_string(k) + std::string(95, 'x');
  EXPECT_THAT(complaint(many), AllOf(HasSubstr("16384"), HasSubstr("shorten")));
  EXPECT_EQ(probebox({"pack", "-", "-"}, "sample," + std::string(100, 'x') + "\n1,2\n").status, 0);
}

TEST(Unpacking, WritesNoNameThatASpreadsheetTakesForAFormula) {
  const auto packed = probebox({"pack", "-", "-"}, "sample,=HYPERLINK(\"http://x\"),+a,-b,@c,a=b\n1,2,3,4,5,6\n");
  ASSERT_EQ(packed.status, 0) << packed.err;
  EXPECT_EQ(probebox({"unpack", "-", "-"}, packed.out).out,
            "sample,'=HYPERLINK(_http://x_),'+a,'-b,'@c,a=b\n1,2,3,4,5,6\n");
  EXPECT_THAT(probebox({"export", "-", "-o", "-"}, packed.out).out,
              testing::StartsWith("sample,time_ns,'=HYPERLINK(_http://x_),'+a,'-b,'@c,a=b,delay_result_id"));
}

TEST(Packing, OverwritesNothingUnlessToldTo) {
  const RuntimeDirectory directory;
  const auto table = directory.file("a.csv"), file = directory.file("a.pbx");
  std::ofstream{table} << "sample,x\n1,2\n";
  EXPECT_EQ(probebox({"pack", table, file}).status, 0);
  EXPECT_EQ(probebox({"pack", table, file}).status, 2);
  EXPECT_EQ(probebox({"pack", "--force", table, file}).status, 0);
  EXPECT_EQ(probebox({"unpack", file, table}).status, 2);
  EXPECT_EQ(probebox({"pack", directory.file("absent.csv"), "-"}).status, 2);
  EXPECT_EQ(probebox({"pack", "--profile", "auto", table, "-"}).status, 2);
}

TEST(ClockCommand, LabelsEdgesAndTellsTicks) {
  std::mt19937_64 random{4};
  std::normal_distribution<double> jitter{0, 3000};
  std::ostringstream table;
  table << "edge_ns,line_seqno\n";
  int seqno = 0;
  for (int k = 0; k < 2000; ++k) {
    ++seqno;
    if (k % 100 == 50) continue;  // lost by the kernel
    table << 1'000'000'000 + 1'000'010LL * k + static_cast<int>(jitter(random)) << ',' << seqno << '\n';
  }
  const RuntimeDirectory directory;
  const auto ticks = directory.file("ticks.csv");
  const auto done = probebox({"clock", "--period-ns", "1000000", "-", "-", "--ticks", ticks}, table.str());
  ASSERT_EQ(done.status, 0) << done.err;
  std::istringstream verdicts{done.out};
  std::string line;
  std::getline(verdicts, line);
  EXPECT_EQ(line, "edge,tick,flag");
  long edges = 0, last_tick = 0, steps_of_two = 0;
  while (std::getline(verdicts, line)) {
    EXPECT_EQ(std::stol(line), edges++);
    if (!line.ends_with("accepted") && !line.ends_with("clipped")) continue;
    const long tick = std::stol(line.substr(line.find(',') + 1));
    steps_of_two += tick == last_tick + 2;
    EXPECT_TRUE(last_tick == 0 || tick == last_tick + 1 || tick == last_tick + 2) << line;
    last_tick = tick;
  }
  EXPECT_EQ(edges, 1980);
  EXPECT_GT(steps_of_two, 15);
  std::ifstream told{ticks};
  std::getline(told, line);
  EXPECT_EQ(line, "tick,time_ns,sigma_ns,state");
  std::string last;
  while (std::getline(told, line)) last = line;
  EXPECT_THAT(last, AllOf(testing::StartsWith(std::to_string(last_tick) + ","), testing::EndsWith(",locked")));
}

TEST(ClockCommand, NamesWhatItCannotUse) {
  EXPECT_THAT(probebox({"clock", "--period-ns", "1000000", "-", "-"}, "edge\n1\n").err, HasSubstr("edge_ns"));
  EXPECT_THAT(probebox({"clock", "--period-ns", "5", "-", "-"}, "edge_ns\n1\n").status, 2);
  EXPECT_THAT(probebox({"clock", "-", "-"}, "edge_ns\n1\n").err, HasSubstr("--period-ns"));
  const auto complaint = [](const std::string& table) {
    const auto refused = probebox({"clock", "--period-ns", "1000000", "-", "-"}, table);
    EXPECT_EQ(refused.status, 2);
    EXPECT_TRUE(refused.out.empty());
    return refused.err;
  };
  EXPECT_THAT(complaint("edge_ns,line_seqno\n"), HasSubstr("no row"));
  EXPECT_THAT(complaint("edge_ns\n1\n5\n5\n4\n"),
              AllOf(HasSubstr("line 5"), HasSubstr("edge_ns 4"), HasSubstr("sort")));
  for (const std::string number : {"-5", "4294967296", "99999999999999"})
    EXPECT_THAT(complaint("edge_ns,line_seqno\n1,4294967295\n2," + number + "\n"),
                HasSubstr("line 3: line_seqno " + number + " is not a number from 0 to 4294967295"));
}

TEST(ClockCommand, WritesTwoTablesIntoTwoFiles) {
  const RuntimeDirectory directory;
  const auto table = directory.file("edges.csv"), output = directory.file("x.csv");
  std::ofstream{table} << "edge_ns\n1\n";
  std::ofstream{output} << "older";
  for (const auto& ticks : {output, directory.file("./x.csv"), std::string{"-"}, std::string{}}) {
    const auto refused = probebox({"clock", "--period-ns", "1000000", "--force", table, output, "--ticks", ticks});
    EXPECT_EQ(refused.status, 2) << ticks;
    EXPECT_THAT(refused.err, HasSubstr("--ticks"));
    EXPECT_EQ(contentOf(output), "older");
  }
  EXPECT_EQ(probebox({"clock", "--period-ns", "1000000", table, directory.file("new.csv"), "--ticks",
                      directory.file("./new.csv")})
                .status,
            2)
      << "neither is there yet";
}

TEST(Tables, KeepTheOlderFileAtCtrlC) {
  const RuntimeDirectory directory;
  const auto table = directory.file("a.csv"), edges = directory.file("edges.csv"), older = directory.file("older");
  std::ofstream{table} << "sample,x\n1,2\n";
  std::ofstream{edges} << "edge_ns\n1\n";
  std::ofstream{older} << "older";
  const std::atomic<bool> interrupted{true};
  const auto status = [&](const std::vector<std::string>& words) { return probebox(words, {}, &interrupted).status; };
  EXPECT_EQ(status({"pack", "--force", table, older}), 130);
  EXPECT_EQ(status({"clock", "--period-ns", "1000000", "--force", edges, older}), 130);
  EXPECT_EQ(contentOf(older), "older");
}

}  // namespace
}  // namespace probebox::command
