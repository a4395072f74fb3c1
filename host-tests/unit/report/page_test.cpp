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
#include "tools/report/decision.hpp"
#include "tools/report/names.hpp"
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

// The full digits that the cells of the tables of values carry, in their order.
std::vector<double> tabled(const std::string& html) {
  std::vector<double> values;
  for (auto from = html.find("<table class=\"values"); from != std::string::npos;
       from = html.find("<table class=\"values", from + 1)) {
    const std::string table = html.substr(from, html.find("</table>", from) - from);
    const std::regex cell{"title=\"([^\"]*)\""};
    for (std::sregex_iterator one{table.begin(), table.end(), cell}, end; one != end; ++one) {
      values.push_back(std::stod((*one)[1]));
    }
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
    EXPECT_THAT(html, HasSubstr("<td>source</td>")) << folder << ": the descriptor names no source";
    EXPECT_THAT(html, HasSubstr("cannot observe")) << folder;
    EXPECT_LT(html.size(), 400000U) << folder;
    missing.erase(subject.method);
  }
  EXPECT_THAT(missing, testing::IsEmpty()) << "methods without a case: add one below unit/report/cases";
}

// All of them with U where they have one, short ones with their sd; what is zero by definition is named instead.
TEST(Report, HasTheNumbersOfTheSolve) {
  for (const auto& folder : caseFolders()) {
    const auto solved = metrology::solve(casefolder::readCase(folder).value());
    ASSERT_TRUE(solved.ok());
    std::multiset<double> expected;
    for (const auto& estimate : solved->estimates) {
      const bool is_short = estimate.shape != metrology::Shape::matrix && estimate.values.size() <= 3;
      for (std::size_t k = 0; k < estimate.values.size(); ++k) {
        if (casefolder::zeroByDefinition(estimate, k)) continue;
        expected.insert(estimate.values[k]);
        if (estimate.sd.empty()) continue;
        expected.insert(2.0 * estimate.uncertainty[k]);
        if (is_short) expected.insert(estimate.sd[k]);
      }
    }
    for (const auto& also : solved->also) {
      const bool is_table = also.shape == metrology::Shape::matrix && also.values.size() > 9;
      for (std::size_t k = 0; is_table && k < also.values.size(); ++k) {
        expected.insert(also.values[k]);
        if (k < also.sd.size() && also.sd[k] > 0) expected.insert(2.0 * also.sd[k]);
      }
    }
    const auto shown = tabled(pageOf(subjectIn(folder)));
    EXPECT_EQ(shown.size(), expected.size()) << folder;
    for (const double number : shown) {
      const auto found = expected.find(number);
      ASSERT_NE(found, expected.end()) << folder << " shows " << number;
      expected.erase(found);
    }
  }
}

std::string boxOf(const std::string& html) {
  const auto from = html.find("<div class=\"verdict");
  return html.substr(from, html.find("</div>", from) - from);
}

TEST(Report, OfARotaryAxisNamesItsErrorsAsTheStandardDoes) {
  const auto html = pageOf(subjectIn(fs::path{PROBEBOX_REPORT_CASES} / "rotary-axis-errors"));
  EXPECT_THAT(boxOf(html), HasSubstr("no limit stated"));
  EXPECT_THAT(boxOf(html), testing::AllOf(HasSubstr("EXC at"), HasSubstr("5.86 \u00b5m"), HasSubstr("0.82 \u00b5m")));
  EXPECT_THAT(boxOf(html), testing::AllOf(HasSubstr("-10.74 \u00b5m"), HasSubstr("0.63 \u00b5m")));
  EXPECT_THAT(boxOf(html), testing::AllOf(HasSubstr("XOC and"), HasSubstr("position of")));
  EXPECT_THAT(html, HasSubstr("<th>angle</th><th class=\"n\">deviation XC (\u00b5m)</th>"));
  EXPECT_THAT(html, HasSubstr("<tr><td>330 deg</td>")) << "complete on paper";
  EXPECT_THAT(html, HasSubstr("ZOC, COC"));
  EXPECT_THAT(html, Not(testing::ContainsRegex("E[XYZABC] \\[")));
  EXPECT_THAT(html, Not(HasSubstr(" more, below")));
}

TEST(Report, IsGreenOnlyWithinALimitAndWithoutAWarning) {
  auto dataset = casefolder::readCase(fs::path{PROBEBOX_REPORT_CASES} / "periodic-check").value();
  const auto of = [&] { return boxOf(pageOf({"case", dataset.method, dataset, metrology::solve(dataset).value()})); };
  EXPECT_THAT(of(), testing::AllOf(HasSubstr("verdict neutral"), HasSubstr("no limit stated"), HasSubstr("Xcen B0")));
  dataset.config["limit_mm"] = 0.02;
  EXPECT_THAT(of(), testing::AllOf(HasSubstr("verdict pass"), HasSubstr("PASS"), HasSubstr("limit 20 \u00b5m")));
  EXPECT_THAT(pageOf({"case", dataset.method, dataset, metrology::solve(dataset).value()}),
              testing::AllOf(HasSubstr("<h2>Conformity"), HasSubstr("ISO 14253-1"), Not(HasSubstr("<td>deviation"))));
  dataset.config["limit_mm"] = 0.0075;
  EXPECT_THAT(of(), testing::AllOf(HasSubstr("verdict warned"), HasSubstr("NOT PROVEN")));
  dataset.config["limit_mm"] = 0.005;
  EXPECT_THAT(of(), testing::AllOf(HasSubstr("verdict failed"), HasSubstr("FAIL")));
  dataset.config["limit_mm"] = 0.3;
  dataset.config["sigma_mm"] = 0.1;  // a hundred times too large, so the residuals contradict it
  EXPECT_THAT(of(), testing::AllOf(HasSubstr("verdict warned"), HasSubstr("WARN")));
}

// A limit that the machine's user states decides, where the method has none of its own.
TEST(Report, IsHeldAgainstTheLimitOfItsSubject) {
  auto subject = subjectIn(fs::path{PROBEBOX_REPORT_CASES} / "delay-known-sphere");
  ASSERT_NE(subject.result(), nullptr);
  std::get<metrology::Result>(subject.answer).warnings.clear();
  EXPECT_EQ(decide(subject).verdict, Verdict::no_limit);
  for (const auto& [proof, verdict] : {std::pair{metrology::Proof::conforms, Verdict::pass},
                                       {metrology::Proof::not_proven, Verdict::warn},
                                       {metrology::Proof::fails, Verdict::fail}}) {
    subject.conformity = Conformity{.proof = proof, .worst = "delay, of which U has the limit 40 us"};
    const auto decision = decide(subject);
    EXPECT_EQ(decision.verdict, verdict);
    EXPECT_GE(decision.lines.size(), 2U) << "the value itself, and what is held against the limit";
  }
  subject.conformity->proof = metrology::Proof::conforms;
  subject.rests_on_retired = true;
  EXPECT_EQ(decide(subject).verdict, Verdict::warn) << "what it was computed with is no longer in force";
}

TEST(Report, IsNotGreenWhereResidualsContradictTheNoise) {
  auto dataset = casefolder::readCase(fs::path{PROBEBOX_REPORT_CASES} / "centreline").value();
  for (const double sigma : {1e-5, 0.1}) {
    dataset.config["sigma_mm"] = sigma;
    const auto html = pageOf({"case", dataset.method, dataset, metrology::solve(dataset).value()});
    EXPECT_THAT(boxOf(html), HasSubstr("verdict warned")) << sigma;
    EXPECT_THAT(html, HasSubstr(sigma < 1e-3 ? "<li>residuals-exceed-noise: " : "<li>residuals-below-noise: "));
  }
}

// Results of a box, each a little further off.
Subject withHistory(int count) {
  Subject subject = subjectIn(fs::path{PROBEBOX_REPORT_CASES} / "rotary-axis-errors");
  for (int k = 0; k < count; ++k) {
    Earlier earlier{"result " + std::to_string(k + 1), "2026-11-01T08:00:00Z", *subject.result()};
    for (auto& estimate : earlier.result.estimates) {
      for (double& value : estimate.values) value -= 1e-4 * (count - k);
    }
    subject.before.history.push_back(earlier);
  }
  if (count > 0) subject.before.in_force = subject.before.history.back();
  return subject;
}

TEST(Report, ComparesWithTheResultInForce) {
  auto subject = withHistory(3);
  auto& force = subject.before.in_force->result;
  for (auto& estimate : force.estimates) {
    if (estimate.key == "location_mm") estimate.values[1] -= 0.005;
  }
  const auto html = pageOf(subject);
  EXPECT_EQ(WellFormed::objectionTo(html), "");
  EXPECT_THAT(boxOf(html), HasSubstr("result 3"));
  EXPECT_THAT(html, HasSubstr("<h2>Change"));
  EXPECT_THAT(html,
              HasSubstr("<td>YOC</td><td class=\"n\">-13.36</td><td class=\"n\">-8.26</td><td class=\"n\">5.10</td>"
                        "<td class=\"n\">0.90</td><td class=\"n\">11</td>"));
  EXPECT_THAT(pageOf(withHistory(0)), Not(HasSubstr("in force")));
}

TEST(Report, ComparesCentresOfALeaningAxisAtOneHeight) {
  Subject subject{"result 9", "c-axis-alignment", {}, metrology::Result{}};
  auto& now = std::get<metrology::Result>(subject.answer);
  now.method = subject.method;
  now.estimates = {metrology::Estimate::vector("centre_mm", {0.1, 0.2}, {1e-4, 1e-4}),
                   metrology::Estimate::vector("C_tilt_rad", {2e-4, 0}, {1e-6, 1e-6})};
  now.also = {metrology::Estimate::scalar("mean_z_mm", 200, std::nullopt)};
  Earlier force{"result 8", "2026-11-01T08:00:00Z", now};
  force.result.estimates[0].values[0] = 0.08;
  force.result.also[0].values[0] = 100;
  subject.before.in_force = force;
  subject.before.history = {force};
  const auto same = pageOf(subject);
  EXPECT_THAT(same, HasSubstr("<td>centre X</td><td class=\"n\">0.10000</td><td class=\"n\">0.10000</td>"
                              "<td class=\"n\">0.00000</td>"));
  EXPECT_THAT(boxOf(same), Not(HasSubstr("look why")));
  subject.before.in_force->result.also[0].values[0] = 200;
  EXPECT_THAT(boxOf(pageOf(subject)), testing::AllOf(HasSubstr("0.02000 mm"), HasSubstr("141 sd")));
}

TEST(Report, ComparesErrorsOfAHeadAtTheSameAnglesAlone) {
  Subject subject{"result 9", "swivel-error", {}, metrology::Result{}};
  auto& now = std::get<metrology::Result>(subject.answer);
  now.method = subject.method;
  now.estimates = {metrology::Estimate::matrix("error_at_queries_mm", 3, {0.01, 0, 0}, {1e-4, 1e-4, 1e-4})};
  now.also = {metrology::Estimate::vector("query_B_deg", {45}, {}),
              metrology::Estimate::vector("query_L_mm", {150}, {})};
  subject.before.in_force = Earlier{"result 8", "2026-11-01T08:00:00Z", now};
  EXPECT_THAT(boxOf(pageOf(subject)), HasSubstr("result 8"));
  subject.before.in_force->result.also[0].values[0] = -45;
  EXPECT_THAT(boxOf(pageOf(subject)), testing::AllOf(HasSubstr("in common"), HasSubstr("result 8")));
}

// A file may say anything.
TEST(Report, NamesAWorstCombinationAsTheAnswerDoesWhereItHasNoSuchValue) {
  metrology::Result result;
  result.method = "bore-fit";
  result.estimates = {metrology::Estimate::vector("other_mm", {1, 2}, {1e-4, 1e-4})};
  result.weakest = {{"other_mm[99999999]", "other_mm[-7]", "other_mm[1]"}, {0.6, 0.6, 0.5}, 3};
  EXPECT_THAT(pageOf({"case", result.method, {}, result}),
              testing::AllOf(HasSubstr("(other_mm[99999999])"), HasSubstr("(other_mm[-7])"), HasSubstr("(other Y)")));
}

// A box keeps dataset and values of a result, not its residuals.
TEST(Report, RecallsTheResidualsOfAKeptResult) {
  for (const auto& folder : caseFolders()) {
    const auto whole = subjectIn(folder);
    if (whole.result() == nullptr) continue;
    auto kept = whole;
    std::get<metrology::Result>(kept.answer).residuals = {};
    EXPECT_TRUE(recallResiduals(kept)) << folder;
    EXPECT_EQ(pageOf(kept), pageOf(whole)) << folder;

    auto other = kept;
    auto& estimate = std::get<metrology::Result>(other.answer).estimates.front();
    if (estimate.sd.empty() || !(estimate.sd.front() > 0.0)) continue;
    std::get<metrology::Result>(other.answer).residuals = {};
    estimate.values.front() += 0.1 * estimate.sd.front();
    EXPECT_FALSE(recallResiduals(other)) << folder << ": another answer's residuals";
    EXPECT_TRUE(other.result()->residuals.values.empty()) << folder;
  }
}

// The certificate of the same result has the second of them.
TEST(Report, NamesTheDegreesOfFreedomOfTheFitAndOfTheUncertainty) {
  metrology::Result result;
  result.method = "delay-known-sphere";
  result.estimates = {metrology::Estimate::scalar("tau_s", 5.2033e-3, 3e-6)};
  result.estimates[0].uncertainty = {5e-6};
  result.dof = 6;
  const auto html = pageOf({"result 17", result.method, {}, result});
  EXPECT_THAT(html, HasSubstr("<td>degrees of freedom \u03bd of the fit</td><td>6, readings minus unknowns</td>"));
  EXPECT_THAT(html, HasSubstr("<td>effective degrees of freedom \u03bd_eff of u</td><td>80, with type B"));
}

TEST(Report, SaysThatItRestsOnARetiredResult) {
  auto subject = subjectIn(fs::path{PROBEBOX_REPORT_CASES} / "centreline");
  subject.rests_on = {"It rests on result 3 about delay, which is RETIRED: repeat this one."};
  EXPECT_THAT(boxOf(pageOf(subject)), testing::AllOf(HasSubstr("result 3"), HasSubstr("RETIRED")));
  EXPECT_THAT(boxOf(pageOf(subject)), HasSubstr("verdict neutral"));
  subject.rests_on_retired = true;
  EXPECT_THAT(boxOf(pageOf(subject)), HasSubstr("verdict warned"));
}

// The readings of a check also give the stylus' offset.
TEST(Report, BeginsWithTheValuesOfItsSubject) {
  metrology::Result result;
  result.method = "periodic-check";
  result.estimates = {metrology::Estimate::scalar("Xcen_B0_mm", 0.154, 5e-5),
                      metrology::Estimate::scalar("Ycen_B0_mm", -0.11, 5e-5)};
  result.also = {metrology::Estimate::scalar("stylus_offset_x_mm", 0.0202, 3e-5),
                 metrology::Estimate::scalar("stylus_offset_y_mm", -0.0133, 3e-5)};
  Subject subject{"result 18", result.method, {}, result};
  EXPECT_THAT(boxOf(pageOf(subject)), HasSubstr("Xcen"));
  subject.about = "stylus-offset-1";
  EXPECT_THAT(boxOf(pageOf(subject)), testing::AllOf(HasSubstr("stylus offset"), Not(HasSubstr("Xcen"))));
}

TEST(Report, PromisesNoBarsWithoutReadings) {
  for (const auto& folder : caseFolders()) {
    auto subject = subjectIn(folder);
    if (subject.method != "delay-multi-speed" || subject.result() == nullptr) continue;
    EXPECT_THAT(pageOf(subject), HasSubstr("mean of the touches, bars of U")) << folder;
    std::get<metrology::Result>(subject.answer).residuals = {};
    EXPECT_THAT(pageOf(subject), Not(HasSubstr("mean of the touches, bars of U"))) << folder;
  }
}

TEST(Report, ShowsTheTrendOfTheLastTen) {
  EXPECT_THAT(pageOf(withHistory(30)), HasSubstr("10 results"));
  EXPECT_THAT(pageOf(withHistory(2)), HasSubstr("3 results"));
  EXPECT_THAT(pageOf(withHistory(0)), Not(HasSubstr("Trend")));
  auto alone = withHistory(2);
  alone.before.in_force.reset();
  EXPECT_THAT(boxOf(pageOf(alone)), HasSubstr("no other"));
  auto other = withHistory(2);  // another method of the subject
  other.before.in_force->result.estimates.clear();
  other.before.history[0].result.estimates.clear();
  EXPECT_THAT(boxOf(pageOf(other)), testing::AllOf(HasSubstr("in common"), HasSubstr("result 2")));
  EXPECT_THAT(pageOf(other), HasSubstr("2 results")) << "one of them has no such value";
  other.before.history[1].result.estimates.clear();
  EXPECT_THAT(pageOf(other), Not(HasSubstr("Trend"))) << "one point is no trend";
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
  EXPECT_THAT(html, HasSubstr("Residuals"));
  EXPECT_EQ(WellFormed::objectionTo(html), "");
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
  EXPECT_THAT(html, HasSubstr("as stamped"));
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
  EXPECT_THAT(html, HasSubstr("7: clipped"));
  EXPECT_THAT(html, HasSubstr("<td>certificate of the sphere (sd_effective_diameter_mm)</td><td>B</td>"));
}

}  // namespace
}  // namespace probebox::report
