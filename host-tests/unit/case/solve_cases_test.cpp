#include "tools/case/solve_cases.hpp"

#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>
#include <limits>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "firmware/metrology/solve.hpp"
#include "scratch_folder.hpp"
#include "tools/case/case_folder.hpp"
#include "tools/case/readable.hpp"
#include "tools/case/solve_json.hpp"

namespace probebox::casefolder {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;
using testing::HasSubstr;

struct Answer {
  int status{};
  std::vector<Json> lines;
  std::string out;
  std::string err;
};

Answer answer(const std::vector<fs::path>& folders, bool json = true) {
  std::ostringstream out;
  std::ostringstream err;
  Answer answer;
  for (const auto& folder : folders) answer.status = std::max(answer.status, solveCase(folder, json, out, err));
  answer.out = out.str();
  answer.err = err.str();
  std::istringstream lines{answer.out};
  for (std::string line; json && std::getline(lines, line);) answer.lines.push_back(Json::parse(line));
  return answer;
}

class SolveCases : public ScratchFolder {};

TEST_F(SolveCases, AnswersInOrderAndWithTheWorstStatus) {
  const auto good = goodCase("good");
  const auto bad = goodCase("bad");
  write("bad/points.csv", "x_mm,y_mm,z_mm\n10,0,0\n");
  const auto nowhere = folder_ / "nowhere";

  EXPECT_EQ(answer({good, good}).status, 0);
  EXPECT_EQ(answer({good, bad}).status, 1);
  const auto all = answer({bad, nowhere, good});
  EXPECT_EQ(all.status, 2);
  EXPECT_THAT(all.err, HasSubstr(nowhere.string()));
  ASSERT_EQ(all.lines.size(), 3U) << "one for each case";
  EXPECT_EQ(all.lines[0]["case"], bad.string());
  EXPECT_EQ(all.lines[0]["status"], "refused");
  EXPECT_EQ(all.lines[0]["refusal"], "too-few-readings");
  EXPECT_THAT(all.lines[0]["reason"].get<std::string>(), testing::StartsWith("too-few-readings: "));
  EXPECT_EQ(all.lines[1]["case"], nowhere.string());
  EXPECT_EQ(all.lines[1]["status"], "unreadable");
  EXPECT_THAT(all.lines[1]["reason"].get<std::string>(), HasSubstr("such folder"));
  EXPECT_EQ(all.lines[2]["status"], "ok");
  for (const auto& line : all.lines) {
    EXPECT_EQ(line.begin().key(), "schema_version");
    EXPECT_EQ(line["schema_version"], kSchemaVersion);
  }
}

TEST_F(SolveCases, PrintsNoControlCharacterOfACase) {
  const auto unknown = folder_ / "unknown", twice = folder_ / "twice";
  write("unknown/config.json", R"({"method": "\u001b[2Jx\u009b"})");
  write("twice/config.json", R"({"\u001b]0;": 1, "\u001b]0;": 2})");
  for (const bool json : {false, true}) {
    const auto refused = answer({unknown, twice}, json);
    EXPECT_EQ(refused.status, 2);
    for (const auto& text : {refused.out, refused.err}) {
      EXPECT_EQ(text.find('\x1b'), std::string::npos) << text;
      EXPECT_EQ(text.find("\u009b"), std::string::npos) << text;
    }
  }
}

// One sample of either stream stamped by a clock that was not set: no memory holds the time between.
TEST_F(SolveCases, AnswersWhatComesAfterAScanWithAStampOfAnotherClock) {
  auto scan = readCase(fs::path{PROBEBOX_REPORT_CASES} / "delay-stepped-scan").value();
  for (auto& table : scan.tables) {
    for (auto& column : table.columns)
      if (column.name == "t_s") column.values.front() -= 1.7e9;
  }
  const auto good = goodCase("good");
  const auto given = answer({good, writeCase(scan, folder_ / "scan").value(), good});
  EXPECT_EQ(given.status, 1);
  ASSERT_EQ(given.lines.size(), 3U);
  EXPECT_EQ(given.lines[1]["refusal"], "gap");
  EXPECT_THAT(given.lines[1]["reason"].get<std::string>(), HasSubstr("1.7"));
  EXPECT_EQ(given.lines[2]["status"], "ok");
}

TEST_F(SolveCases, NamesTheColumnsThatItFoundWhereOneIsMissing) {
  const auto folder = goodCase("case");
  write("case/points.csv", "x_mm,Y_mm,z_mm\n10,0,0\n");
  EXPECT_EQ(answer({folder}).lines.at(0)["reason"],
            "missing-column: table 'points' has no column 'y_mm': give x_mm,y_mm,z_mm; it has x_mm,Y_mm,z_mm");
}

TEST_F(SolveCases, SaysTheResidualRmsWithTheUnitOfTheReport) {
  const auto folder = goodCase("case");
  write("case/points.csv", "x_mm,y_mm,z_mm\n10,0,0\n-10,0,0\n0,10,0\n0,-10,0\n0,0,10\n0,0,-10.0012\n7.07,7.07,0\n");
  EXPECT_THAT(answer({folder}, false).out, testing::ContainsRegex("rms [0-9.]+ um, "));
}

TEST_F(SolveCases, RefusesContentThatCannotSupportAnAnswer) {
  const auto refusal = [&](const std::string& text) {
    const auto folder = goodCase("case");
    write("case/points.csv", text);
    const auto given = answer({folder});
    EXPECT_EQ(given.status, 1);
    return given.lines.at(0)["refusal"].get<std::string>();
  };
  EXPECT_EQ(refusal(""), "empty-file");
  EXPECT_EQ(refusal("x_mm,y_mm,z_mm\n"), "empty-table");
  EXPECT_EQ(refusal("x_mm,y_mm,z_mm\n1,2,nan\n"), "not-finite");
  EXPECT_EQ(refusal("x_mm,y_mm,z_mm\n1,2,3\n4,5"), "truncated-file");
  fs::remove(folder_ / "case" / "points.csv");
  EXPECT_EQ(answer({folder_ / "case"}).lines.at(0)["refusal"], "missing-table");
  write("case/config.json", R"({"method": "no-such-method"})");
  EXPECT_EQ(answer({folder_ / "case"}).lines.at(0)["refusal"], "unknown-method");
  EXPECT_THAT(answer({folder_ / "case"}).lines.at(0)["reason"].get<std::string>(), HasSubstr("sphere-fit"));
}

TEST_F(SolveCases, SaysWhatTheResultRestsOn) {
  const auto folder = goodCase("case");
  write("case/config.json",
        R"({"method": "sphere-fit", "sigma_mm": 0.001, "radius_mm": 10, "sd_radius_mm": 0.002, "probe": "P-7"})");
  const Json line = answer({folder}).lines.at(0);
  const auto& sd = line["sd"]["centre_mm"];
  EXPECT_EQ(line["budget"][0]["name"], "readings");
  EXPECT_EQ(line["budget"][0]["sd"]["centre_mm"], sd);
  EXPECT_EQ(line["budget"][1]["name"], "sd_radius_mm");
  EXPECT_EQ(line["budget"][1]["type"], "B");
  for (std::size_t k = 0; k < 3; ++k) {
    double squares = 0;
    for (const auto& one : line["budget"]) squares += std::pow(one["sd"]["centre_mm"][k].get<double>(), 2);
    EXPECT_NEAR(line["expanded_k2"]["centre_mm"][k].get<double>(), 2.0 * std::sqrt(squares), 1e-12);
    EXPECT_NEAR(line["design"]["centre_mm"][k].get<double>() * 0.001, sd[k].get<double>(), 1e-9);
  }
  EXPECT_EQ(line["conditions"]["probe"], "P-7");
  EXPECT_THAT(line["conditions"]["accuracy"].get<std::string>(), HasSubstr("lost_motion_um 5"))
      << "of a machine of which nothing is stated";
  EXPECT_FALSE(line["unobservable"].empty());
  EXPECT_EQ(line["residuals"]["values"].size(), 5U);
  EXPECT_EQ(line["residuals"]["names"][4], "point 5");
}

TEST_F(SolveCases, PrintsATableForAPerson) {
  const auto text = answer({goodCase("case")}, false).out;
  EXPECT_THAT(text, HasSubstr("; U 0.00"));
  EXPECT_THAT(text, HasSubstr("design: sd"));
  EXPECT_THAT(text, HasSubstr("radius"));
  EXPECT_THAT(text, HasSubstr("+/-"));
  EXPECT_THAT(text, HasSubstr("mm"));
}

// Of two checks of one machine; X is 13.43 um from the axis, U is 1 um.
TEST_F(SolveCases, SaysTheVerdictOfACheckFirst) {
  const auto check = [this](std::optional<double> limit_mm) {
    const fs::path measured = fs::path{PROBEBOX_REPORT_CASES} / "periodic-check";
    fs::create_directories(folder_ / "check");
    for (const auto& file : fs::directory_iterator{measured})
      fs::copy_file(file, folder_ / "check" / file.path().filename(), fs::copy_options::overwrite_existing);
    std::ifstream config{measured / "config.json"};
    Json described = Json::parse(config);
    if (limit_mm) described.update({{"accepted_Xcen_B0_mm", 0}, {"limit_Xcen_B0_mm", *limit_mm}});
    write("check/config.json", described.dump());
    return answer({folder_ / "check"}, false).out;
  };
  EXPECT_THAT(check(0.015), HasSubstr("periodic-check\n  PASS"));
  EXPECT_THAT(check(0.0135), HasSubstr("periodic-check\n  NOT PROVEN"));
  EXPECT_THAT(check(0.012), HasSubstr("periodic-check\n  FAIL"));
  EXPECT_THAT(check({}), HasSubstr("periodic-check\n  Xcen B0 "));
}

// The radius is taken as known to 0.01 mm, which moves the centre along Z alone.
TEST_F(SolveCases, PrintsTheCombinedUncertaintyBehindPlusMinus) {
  const auto folder = goodCase("case");
  write("case/config.json", R"({"method": "sphere-fit", "sigma_mm": 0.001, "radius_mm": 10, "sd_radius_mm": 0.01,
    "scale_ppm": 0, "squareness_urad": 0, "lost_motion_um": 0, "drift_um_per_min": 0})");
  EXPECT_THAT(answer({folder}, false).out,
              testing::ContainsRegex("centre Z +0.000 \\+/- 0.010 mm, sd 0.00100 mm; U 0.020 mm"));
}

TEST(Readable, HasOneUnitForAKindOfValueAndTwoDigitsOfItsSd) {
  const auto read = [](const std::string& key, double value, std::optional<double> sd) {
    const auto label = labelOf(key);
    return label.name + " " + withUncertainty(label, value, sd);
  };
  EXPECT_EQ(read("tau_s", 5.4471e-3, 5.0e-6), "delay 5447.1 +/- 5.0 us");
  EXPECT_EQ(read("effective_diameter_mm", 30.99991, 0.000123), "effective_diameter 30.99991 +/- 0.00012 mm");
  EXPECT_EQ(read("speed_mm_s", 12.5, std::nullopt), "speed 12.5 mm/s");
  EXPECT_EQ(read("ratio", 0.25, std::nullopt), "ratio 0.25");
  EXPECT_EQ(read("tau_s[2]", 5.4471e-3, 5.0e-6), "delay[2] 5447.1 +/- 5.0 us");
  EXPECT_EQ(read("EXC_at_60_deg_mm", 0.25779, 0.00028), "EXC_at_60_deg 0.25779 +/- 0.00028 mm");
  EXPECT_EQ(read("x_mm", 1e308, 0.1), "x 1e+308 +/- 0.10 mm") << "no three hundred digits";
}

TEST(SolveJson, NeverHoldsWhatIsNotANumber) {
  metrology::Result result;
  result.method = "x";
  const double nan = std::numeric_limits<double>::quiet_NaN();
  result.estimates = {metrology::Estimate::scalar("tau_s", nan, nan),
                      metrology::Estimate::matrix("six_errors", 2, {1.0, nan, 3.0, 4.0}, {})};
  result.rms = 1.0 / 0.0;
  const Json line = Json::parse(toJson(result, "case").dump());
  EXPECT_TRUE(line["result"]["tau_s"].is_null());
  EXPECT_EQ(line["result"]["six_errors"].dump(), "[[1.0,null],[3.0,4.0]]");
  EXPECT_TRUE(line["sd"]["six_errors"].is_null());
  EXPECT_TRUE(line["rms"].is_null());
}

TEST(SolveJson, SaysNoSdAtAllAsNull) {
  metrology::Result result;
  result.estimates = {metrology::Estimate::scalar("tau_s", 1.0, std::nullopt)};
  EXPECT_TRUE(toJson(result, "case")["sd"].is_null());
}

TEST(SolveJson, HoldsTheSdOfWhatWasFoundOnTheWay) {
  metrology::Result result;
  result.estimates = {metrology::Estimate::scalar("tau_s", 1.0, std::nullopt)};
  result.also = {metrology::Estimate::scalar("speed_mm_s", 25.0, std::nullopt),
                 metrology::Estimate::matrix("swivel_terms_mm", 2, {1.0, 2.0, 3.0, 4.0}, {0.1, 0.2, 0.3, 0.4})};
  const Json line = toJson(result, "case");
  EXPECT_EQ(line["also_sd"]["swivel_terms_mm"].dump(), "[[0.1,0.2],[0.3,0.4]]");
  EXPECT_FALSE(line["also_sd"].contains("speed_mm_s"));
}

// The bundled measurements, whose truth only this test reads.
std::vector<double> flat(const Json& value) {
  if (value.is_number()) return {value.get<double>()};
  return value.get<std::vector<double>>();
}

std::vector<fs::path> bundledCases() {
  std::vector<fs::path> folders;
  for (const auto& entry : fs::recursive_directory_iterator{PROBEBOX_CASES}) {
    if (entry.path().filename() == "config.json") folders.push_back(entry.path().parent_path());
  }
  return folders;
}

TEST(BundledCases, AreSolvedWithinFourStandardDeviations) {
  ASSERT_EQ(bundledCases().size(), 4U);
  for (const auto& folder : bundledCases()) {
    std::ifstream file{folder / "truth.json"};
    const Json truth = Json::parse(file);
    const auto given = answer({folder});
    ASSERT_EQ(given.status, 0) << given.out;
    for (const auto& [key, value] : truth["truth"].items()) {
      const auto expected = flat(value);
      const auto bound = flat(truth["crb_sd"][key]);
      const auto solved = flat(given.lines[0]["result"][key]);
      const auto sd = flat(given.lines[0]["sd"][key]);
      ASSERT_EQ(solved.size(), expected.size());
      for (std::size_t k = 0; k < expected.size(); ++k) {
        EXPECT_NEAR(solved[k], expected[k], 4.0 * std::min(bound[k], sd[k])) << folder << " " << key;
        EXPECT_LT(sd[k], 1.05 * bound[k]) << folder << " " << key;
        EXPECT_GT(sd[k], 0.3 * bound[k]) << folder << " " << key;
      }
    }
  }
}

// What is saved solves to the same digits.
TEST_F(SolveCases, GivesTheSameDigitsForASavedDataset) {
  for (const auto& folder : bundledCases()) {
    auto dataset = readCase(folder);
    ASSERT_TRUE(dataset.ok());
    // Digits that no rounded file would hold.
    for (auto& table : dataset.value().tables) {
      if (table.name != "machine" && table.name != "points") continue;
      for (auto& column : table.columns) {
        if (column.name == "touch") continue;
        for (double& value : column.values) value += 1e-9 / 3.0;
      }
    }
    const auto saved = folder_ / folder.parent_path().filename() / folder.filename();
    ASSERT_TRUE(writeCase(dataset.value(), saved).ok());
    const auto here = metrology::solve(dataset.value());
    ASSERT_TRUE(here.ok());
    EXPECT_EQ(toJson(here.value(), saved.string()).dump(),
              toJson(metrology::solve(readCase(saved).value()).value(), saved.string()).dump());
  }
}

}  // namespace
}  // namespace probebox::casefolder
