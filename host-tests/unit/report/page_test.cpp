#include "tools/report/page.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>

#include "firmware/metrology/solve.hpp"
#include "tools/case/case_folder.hpp"
#include "tools/case/solve_json.hpp"
#include "tools/report/subjects.hpp"
#include "well_formed.hpp"

namespace probebox::report {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

std::vector<fs::path> caseFolders() {
  std::vector<fs::path> folders;
  for (const char* root : {PROBEBOX_REPORT_CASES, PROBEBOX_CASES}) {
    for (const auto& entry : fs::recursive_directory_iterator{root}) {
      if (entry.path().filename() == "config.json") folders.push_back(entry.path().parent_path());
    }
  }
  std::ranges::sort(folders);
  return folders;
}

Subject subjectIn(const fs::path& folder) {
  auto found = subjectsIn(folder);
  EXPECT_TRUE(found.ok()) << found.error().what;
  return found.value().front();
}

std::string pageOf(const Subject& subject) {
  return page(std::span{&subject, 1}, "test");
}

std::size_t count(const std::string& text, const std::string& what) {
  std::size_t found = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++found;
  return found;
}

// The full digits that the cells of the table of values carry, in their order.
std::vector<double> tabled(const std::string& html) {
  const auto from = html.find("<table class=\"values\">");
  const std::string table = html.substr(from, html.find("</table>", from) - from);
  const std::regex cell{"title=\"([^\"]*)\""};
  std::vector<double> values;
  for (std::sregex_iterator one{table.begin(), table.end(), cell}, end; one != end; ++one) {
    values.push_back(std::stod((*one)[1]));
  }
  return values;
}

TEST(Report, RendersEveryMethod) {
  std::set<std::string_view> missing;
  for (const auto name : metrology::methods()) missing.insert(name);
  for (const auto& folder : caseFolders()) {
    const Subject subject = subjectIn(folder);
    ASSERT_NE(subject.result(), nullptr) << folder << " " << subject.refusal()->reason;
    const auto html = pageOf(subject);
    EXPECT_EQ(WellFormed::objectionTo(html), "") << folder;
    EXPECT_GE(count(html, "<svg "), 1U) << folder;
    EXPECT_THAT(html, Not(HasSubstr("nan"))) << folder;
    EXPECT_THAT(html, Not(HasSubstr("<script"))) << folder;
    EXPECT_THAT(html, Not(HasSubstr("src="))) << folder;
    EXPECT_THAT(html, Not(HasSubstr("href="))) << folder;
    EXPECT_THAT(html, HasSubstr("patent")) << folder << ": nobody has looked up what this method is";
    EXPECT_THAT(html, HasSubstr("cannot observe")) << folder;
    EXPECT_LT(html.size(), 400000U) << folder;
    missing.erase(subject.method);
  }
  EXPECT_THAT(missing, testing::IsEmpty()) << "methods without a case: add one below unit/report/cases";
}

// All of them, short estimates first; of a long table the beginning.
TEST(Report, HasTheNumbersOfTheSolve) {
  for (const auto& folder : caseFolders()) {
    const auto solved = metrology::solve(casefolder::readCase(folder).value());
    ASSERT_TRUE(solved.ok());
    std::multiset<double> expected;
    for (const auto& estimate : solved->estimates) {
      for (std::size_t k = 0; k < estimate.values.size(); ++k) {
        expected.insert(estimate.values[k]);
        if (estimate.sd.empty()) continue;
        expected.insert(estimate.sd[k]);
        expected.insert(2.0 * estimate.uncertainty[k]);
      }
    }
    const auto shown = tabled(pageOf(subjectIn(folder)));
    EXPECT_GE(shown.size(), std::min<std::size_t>(expected.size(), 60)) << folder;
    if (expected.size() <= 100) {
      EXPECT_EQ(shown.size(), expected.size()) << folder;
    }
    for (const double number : shown) {
      const auto found = expected.find(number);
      ASSERT_NE(found, expected.end()) << folder << " shows " << number;
      expected.erase(found);
    }
  }
}

// The location of an axis stands before the six errors at every angle.
TEST(Report, BeginsWithWhatAReaderLooksFor) {
  const auto html = pageOf(subjectIn(fs::path{PROBEBOX_REPORT_CASES} / "rotary-axis-errors"));
  const auto verdict = html.substr(html.find("class=\"verdict\""), 200);
  EXPECT_THAT(verdict, HasSubstr("location [0] = "));
  EXPECT_THAT(html, HasSubstr("<td>EC [0]</td>"));
}

// The page of an answer is that of its case.
TEST(Report, OfAnAnswerIsThatOfItsCase) {
  for (const auto& folder : caseFolders()) {
    const Subject direct = subjectIn(folder);
    const auto json = casefolder::toJson(*direct.result(), folder.string()).dump();
    const auto read = subjectsOf(json, "answers");
    ASSERT_TRUE(read.ok()) << read.error().what;
    EXPECT_EQ(tabled(pageOf(read->front())), tabled(pageOf(direct))) << folder;
    EXPECT_EQ(count(pageOf(read->front()), "<svg "), count(pageOf(direct), "<svg ")) << folder;
  }
}

TEST(Report, OfAnAnswerAloneHasItsResiduals) {
  const Subject direct = subjectIn(fs::path{PROBEBOX_REPORT_CASES} / "centreline");
  const auto json = casefolder::toJson(*direct.result(), "/no/such/case").dump();
  const auto html = pageOf(subjectsOf(json + "\n\n" + json, "answers").value().back());
  EXPECT_THAT(html, HasSubstr("Residuals by reading"));
  EXPECT_EQ(WellFormed::objectionTo(html), "");
}

TEST(Subjects, OfAnAnswerHaveTheSdOfWhatWasFoundOnTheWay) {
  metrology::Result result;
  result.method = "swivel-error";
  result.estimates = {metrology::Estimate::scalar("tau_s", 1.0, 0.1)};
  result.also = {metrology::Estimate::matrix("swivel_terms_mm", 2, {1.0, 2.0, 3.0, 4.0}, {0.1, 0.2, 0.3, 0.4})};
  const auto read = subjectsOf(casefolder::toJson(result, "case").dump(), "answers");
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->front().result()->find("swivel_terms_mm")->sd, result.also.front().sd);
}

TEST(Report, EscapesWhatTheCaseSays) {
  auto dataset = casefolder::readCase(fs::path{PROBEBOX_REPORT_CASES} / "centreline").value();
  dataset.config["probe"] = std::string{"<b>\" onload='x' & co"};
  auto solved = metrology::solve(dataset).value();
  solved.warnings.emplace_back("</ul><script>alert(1)</script>");
  const auto html = pageOf({"a<b", dataset.method, dataset, solved});
  EXPECT_EQ(WellFormed::objectionTo(html), "");
  EXPECT_THAT(html, HasSubstr("&lt;b&gt;&quot; onload=&#39;x&#39; &amp; co"));
  EXPECT_THAT(html, Not(HasSubstr("<script")));
  EXPECT_THAT(html, HasSubstr("a&lt;b"));
}

TEST(Report, OfARefusalShowsItWithItsRemedyAndTheRawData) {
  auto dataset = casefolder::readCase(fs::path{PROBEBOX_REPORT_CASES} / "delay-known-sphere").value();
  dataset.config.erase("effective_diameter_mm");
  const auto refusal = metrology::solve(dataset).error();
  const auto html = pageOf({"case", dataset.method, dataset, refusal});
  EXPECT_EQ(WellFormed::objectionTo(html), "");
  EXPECT_THAT(html, HasSubstr("Refused: missing-key"));
  EXPECT_THAT(html, HasSubstr("add it"));
  EXPECT_THAT(html, HasSubstr("Machine as stamped"));
  EXPECT_THAT(html, Not(HasSubstr("class=\"values\"")));
  for (const auto& folder : caseFolders()) {
    auto any = casefolder::readCase(folder).value();
    const auto raw = pageOf({"case", any.method, any, metrology::Refusal{"some-name", "why; what to do"}});
    EXPECT_GE(count(raw, "<svg "), 1U) << folder;
    EXPECT_EQ(WellFormed::objectionTo(raw), "") << folder;
  }
}

TEST(Report, ShowsDroppedReadingsAndTheBudget) {
  auto dataset = casefolder::readCase(fs::path{PROBEBOX_REPORT_CASES} / "delay-known-sphere").value();
  dataset.config["sd_effective_diameter_mm"] = 0.5e-3;
  auto solved = metrology::solve(dataset).value();
  solved.dropped.push_back({"touch 7", "clipped"});
  const auto html = pageOf({"case", dataset.method, dataset, solved});
  EXPECT_THAT(html, HasSubstr("touch 7: clipped"));
  EXPECT_THAT(html, HasSubstr("<td>sd_effective_diameter_mm</td><td>B</td>"));
}

TEST(Subjects, SayWhatCannotBeRead) {
  EXPECT_THAT(subjectsOf("", "x").error().what, HasSubstr("x: empty"));
  EXPECT_THAT(subjectsOf("{\"a\":1}", "x").error().what, HasSubstr("no answer"));
  EXPECT_THAT(subjectsOf("{\"status\":", "x").error().what, HasSubstr("x, line 1: not JSON"));
  EXPECT_THAT(subjectsIn("/no/such/thing").error().what, HasSubstr("/no/such/thing"));
}

}  // namespace
}  // namespace probebox::report
