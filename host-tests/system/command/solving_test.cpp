#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <string>

#include "in_process.hpp"
#include "runtime_directory.hpp"

namespace probebox::command {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class Solving : public testing::Test {
 protected:
  std::string folder(const std::string& name, const std::string& config, const std::string& points) {
    const auto path = directory_.file(name);
    std::filesystem::create_directory(path);
    std::ofstream{path + "/config.json"} << config;
    std::ofstream{path + "/points.csv"} << points;
    return path;
  }
  RuntimeDirectory directory_;
};

TEST_F(Solving, ReportsCasesAndAnswersAsOnePage) {
  const auto good = folder("good", R"({"method": "sphere-fit", "sigma_mm": 0.001})",
                           "x_mm,y_mm,z_mm\n11,0,0\n9,0,0\n10,1,0\n10,-1,0\n10,0,1\n");
  const auto bad = folder("bad", R"({"method": "sphere-fit", "sigma_mm": 0.001})", "x_mm,y_mm,z_mm\n11,0,0\n");
  const auto page = directory_.file("page.html");
  const auto written = probebox({"report", good, "-o", page, "--json"});
  EXPECT_EQ(written.status, 0) << written.err << written.out;
  EXPECT_EQ(written.object()["answers"], 1);
  EXPECT_TRUE(std::filesystem::exists(page));
  const auto again = probebox({"report", good, "-o", page});
  EXPECT_EQ(again.status, 2) << "nothing is overwritten unasked";
  EXPECT_THAT(again.err, HasSubstr("--force"));

  const auto answers = directory_.file("answers.json");
  std::ofstream{answers} << probebox({"solve", "--json", good}).out;
  const auto to_pipe = probebox({"report", answers, bad, "-o", "-"});
  EXPECT_EQ(to_pipe.status, 1) << "a refused case has its report, and its status";
  EXPECT_THAT(to_pipe.out, AllOf(HasSubstr("<!DOCTYPE html>"), HasSubstr("Refused: "), HasSubstr("U = ")));
  EXPECT_THAT(to_pipe.err, AllOf(HasSubstr("1 solved"), HasSubstr("1 refused")));

  const auto nothing = probebox({"report", directory_.file("absent"), "-o", "-"});
  EXPECT_EQ(nothing.status, 2);
  EXPECT_THAT(nothing.err, HasSubstr("absent"));
}

TEST_F(Solving, PrintsOneObjectALineAndTheWorstStatus) {
  const auto good = folder("good", R"({"method": "sphere-fit", "sigma_mm": 0.001})",
                           "x_mm,y_mm,z_mm\n11,0,0\n9,0,0\n10,1,0\n10,-1,0\n10,0,1\n");
  const auto bad = folder("bad", R"({"method": "sphere-fit", "sigma_mm": 0.001})", "x_mm,y_mm,z_mm\n11,0,0\n");
  const auto solved = probebox({"solve", "--json", good});
  EXPECT_EQ(solved.status, 0) << solved.err << solved.out;
  EXPECT_NEAR(solved.object()["result"]["centre_mm"][0].get<double>(), 10, 1e-9);

  const auto refused = probebox({"solve", bad, good});
  EXPECT_EQ(refused.status, 1);
  ASSERT_EQ(refused.objects().size(), 2U) << "objects also without --json, when nobody looks at a terminal";
  EXPECT_EQ(refused.objects()[0]["status"], "refused");
  EXPECT_EQ(refused.objects()[1]["status"], "ok");

  const auto unreadable = probebox({"solve", "--json", bad, directory_.file("absent"), good});
  EXPECT_EQ(unreadable.status, 2);
  EXPECT_EQ(probebox({"solve"}).status, 2) << "a case is required";
  ASSERT_EQ(unreadable.objects().size(), 3U) << "one object for each case, in the order given";
  EXPECT_EQ(unreadable.objects()[1]["status"], "unreadable");
  for (const auto& object : unreadable.objects()) EXPECT_EQ(object.begin().key(), "schema_version");
  EXPECT_THAT(unreadable.err, HasSubstr("absent"));
}

}  // namespace
}  // namespace probebox::command
