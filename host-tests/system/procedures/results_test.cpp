#include <cmath>
#include <filesystem>
#include <gmock/gmock.h>

#include "host-tests/support/file_content.hpp"
#include "on_the_machine.hpp"
#include "tools/case/case_folder.hpp"

// Stored results can be looked at, compared and reported, without the case folders that they came from.
namespace probebox::command {
namespace {

using support::contentOf;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

// A ball of 15 mm at x_mm, each coordinate read to sigma_mm.
metrology::Dataset ball(double x_mm, double sigma_mm) {
  metrology::Dataset dataset{
      .method = "sphere-fit",
      .config = {{"sigma_mm", sigma_mm}, {"radius_mm", 15.0}, {"sd_radius_mm", sigma_mm}, {"probe", std::string{}}},
      .tables = {}};
  dataset.config.erase("probe");
  auto points = metrology::Table::withColumns("points", std::array<std::string_view, 3>{"x_mm", "y_mm", "z_mm"});
  for (int k = 0; k < 24; ++k) {
    const double z = -1 + (k + 0.5) / 12, turn = 2.4 * k, across = std::sqrt(1 - z * z);
    const double radius_mm = 15 + 0.5 * sigma_mm * std::sin(13.0 * k);
    points.append({x_mm + radius_mm * across * std::cos(turn), radius_mm * across * std::sin(turn), radius_mm * z});
  }
  dataset.tables = {std::move(points)};
  return dataset;
}

class StoredResults : public OnTheMachine {
 protected:
  std::string proposed(double x_mm, double sigma_mm = 0.001) {
    const auto folder = directory_.file("case-" + std::to_string(++cases_));
    EXPECT_TRUE(casefolder::writeCase(ball(x_mm, sigma_mm), folder));
    const auto done = box({"propose", folder, "--as-this-machine", "--by", "Ada", "--json"});
    EXPECT_EQ(done.status, 0) << done.err;
    std::filesystem::remove_all(folder);
    return std::to_string(done.object()["result_id"].get<int>());
  }

 private:
  int cases_{};
};

TEST_F(StoredResults, AreListedByWhatTheyCountForNow) {
  EXPECT_THAT(box({"results"}).err, HasSubstr("no result"));
  EXPECT_EQ(box({"results", "--json"}).object()["results"].dump(), "[]");
  EXPECT_EQ(box({"history", "--json"}).object()["transitions"].dump(), "[]");
  const auto first = proposed(10), second = proposed(10.001), third = proposed(10.002);
  ASSERT_EQ(box({"accept", first, "--by", "Ada"}).status, 0);
  ASSERT_EQ(box({"accept", second, "--by", "Grace"}).status, 0);
  const auto page = box({"results"}).out;
  const auto in_force = page.find("in force"), waiting = page.find("proposed\n"), retired = page.find("retired\n");
  ASSERT_NE(in_force, std::string::npos) << page;
  EXPECT_LT(in_force, waiting) << page;
  EXPECT_LT(waiting, retired) << page;
  EXPECT_LT(page.find("accepted by Grace"), waiting);
  EXPECT_GT(page.find("accepted by Ada"), retired);
  EXPECT_THAT(page, AllOf(HasSubstr("centre X"), HasSubstr(" mm"), HasSubstr("+/-")));

  const auto objects = box({"results", "sphere-fit", "--json"}).objects();
  ASSERT_EQ(objects.size(), 3U);
  EXPECT_EQ(objects[0]["id"], std::stoi(second));
  EXPECT_EQ(objects[0]["standing"], "in force");
  EXPECT_EQ(objects[1]["id"], std::stoi(third));
  EXPECT_EQ(objects[2]["state"], "retired");
  const auto typo = box({"results", "sphere-fti"});
  EXPECT_EQ(typo.status, 1);
  EXPECT_THAT(typo.err, HasSubstr("sphere-fit?"));
}

TEST_F(StoredResults, AreShownWithAllThatTheBoxKeeps) {
  const auto id = proposed(10);
  ASSERT_EQ(box({"accept", id, "--by", "Ada"}).status, 0);
  const auto page = box({"show", id}).out;
  EXPECT_THAT(page, AllOf(HasSubstr("centre X"), HasSubstr(", sd "), HasSubstr(", U "), HasSubstr("degrees"),
                          HasSubstr("uncertainty budget"), HasSubstr("sd_radius_mm"), HasSubstr("by Ada"),
                          HasSubstr("its dataset is kept: probebox report " + id)));
  const auto object = box({"show", id, "--json"}).object();
  EXPECT_EQ(object["standing"], "in force");
  EXPECT_NEAR(object["result"]["centre_mm[0]"].get<double>(), 10, 1e-3);
  EXPECT_GT(object["expanded_k2"]["centre_mm[0]"].get<double>(), 2 * object["sd"]["centre_mm[0]"].get<double>())
      << "type B inputs are in it";
  EXPECT_EQ(object["history"].size(), 3U) << "proposed, accepted, in force";
  EXPECT_EQ(object["dataset_kept"], true);
  EXPECT_EQ(box({"show", "4711"}).status, 4);
}

TEST_F(StoredResults, ThatWereRefusedSayWhy) {
  const auto folder = directory_.file("three-points");
  auto few = ball(10, 0.001);
  for (auto& column : few.tables[0].columns) column.values.resize(2);
  ASSERT_TRUE(casefolder::writeCase(few, folder));
  const auto refused = box({"propose", folder, "--as-this-machine", "--by", "Ada", "--json"});
  ASSERT_EQ(refused.status, 1) << refused.err;
  const auto id = std::to_string(refused.objects().front()["result_id"].get<int>());
  EXPECT_THAT(box({"show", id}).out, HasSubstr("refused: too-few-readings"));
  EXPECT_EQ(box({"show", id, "--json"}).object()["refusal"], "too-few-readings");
}

TEST_F(StoredResults, AreComparedBeforeTheyComeIntoForce) {
  const auto first = proposed(10);
  const auto begun = box({"accept", first, "--by", "Ada"});
  EXPECT_EQ(begun.status, 0);
  EXPECT_THAT(begun.out, HasSubstr("first of"));

  // A hundredth of a millimetre, where each centre is known to some tenths of a micrometre.
  const auto far = proposed(10.01);
  const auto refused = box({"accept", far, "--by", "Ada"});
  EXPECT_EQ(refused.status, 1);
  EXPECT_THAT(refused.out, AllOf(HasSubstr("would replace result " + first), HasSubstr("difference")));
  EXPECT_THAT(refused.err, HasSubstr("--although-it-differs"));
  EXPECT_EQ(box({"results", "--json"}).objects()[0]["id"], std::stoi(first)) << "nothing has changed";

  const auto meant = box({"accept", far, "--by", "Ada", "--although-it-differs", "--json"}).object();
  EXPECT_EQ(meant["state"], "active");
  EXPECT_EQ(meant["comparison"]["in_force_id"], std::stoi(first));
  const auto x = meant["comparison"]["values"]["centre_mm[0]"];
  EXPECT_NEAR(x["difference"].get<double>(), 0.01, 1e-5);
  const double sd = std::hypot(x["sd"].get<double>(), x["in_force"]["sd"].get<double>());
  EXPECT_NEAR(x["difference_in_sd"].get<double>(), 0.01 / sd, 0.01 * 0.01 / sd);

  const auto near = proposed(10.01 + 0.5 * sd);
  EXPECT_EQ(box({"accept", near, "--by", "Ada"}).status, 0) << "within what is expected nobody is asked";
}

TEST_F(StoredResults, AreReportedFromWhatTheBoxKeeps) {
  const auto id = proposed(10), other = proposed(10.0005);
  ASSERT_EQ(box({"accept", id, "--by", "Ada"}).status, 0);
  const auto page = directory_.file("page.html");
  const auto done = box({"report", id, "sphere-fit", "-o", page});
  ASSERT_EQ(done.status, 0) << done.err;
  const auto html = contentOf(page);
  EXPECT_THAT(html, AllOf(HasSubstr("result " + id + ", in force"), HasSubstr("<svg")));
  EXPECT_THAT(html, Not(HasSubstr("result " + other))) << "the subject is that in force";

  // Datasets of 20 that were never accepted are kept.
  for (int k = 0; k < 20; ++k) proposed(10 + k * 1e-4);
  const auto lost = box({"report", other, "-o", directory_.file("lost.html")});
  EXPECT_EQ(lost.status, 1);
  EXPECT_THAT(lost.err, AllOf(HasSubstr("the dataset"), HasSubstr("measure again")));
  EXPECT_FALSE(std::filesystem::exists(directory_.file("lost.html")));
  EXPECT_THAT(box({"show", other}).out, HasSubstr("longer kept"));
  EXPECT_EQ(box({"report", id, "--force", "-o", page}).status, 0) << "that of an accepted one is";
  EXPECT_THAT(box({"report", "swivel-x", "-o", page, "--force"}).err, HasSubstr("no result"));
}

TEST_F(StoredResults, AreReportedWithTheChangeAndTheTrend) {
  std::string last;
  for (int k = 0; k < 4; ++k) {
    last = proposed(10 + k * 1e-4);
    if (k != 1) continue;
    ASSERT_EQ(box({"accept", last, "--by", "Ada"}).status, 0);
  }
  const auto page = directory_.file("page.html");
  ASSERT_EQ(box({"report", last, "-o", page}).status, 0);
  const auto html = contentOf(page);
  EXPECT_THAT(html, HasSubstr("result 2")) << "the one in force";
  EXPECT_THAT(html, HasSubstr("4 results"));
}

TEST_F(StoredResults, OfTheDelayAreOnThePageOfInfoAtOnce) {
  const auto in_info = [&] { return box({"info", "--json"}).object()["delay"]["result_id"].get<int>(); };
  for (const int id : {1, 2}) {
    ASSERT_EQ(box({"calibrate", "--speed", "20,40"}).status, 0);
    ASSERT_EQ(box({"accept", std::to_string(id), "--by", "Ada", "--although-it-differs"}).status, 0);
    EXPECT_EQ(in_info(), id);
  }
  ASSERT_EQ(box({"rollback", "delay", "--by", "Ada"}).status, 0);
  EXPECT_EQ(in_info(), 1);
}

TEST_F(StoredResults, AxesAreHomedFromAHost) {
  nlohmann::ordered_json axes;
  for (int attempt = 0; attempt < 200; ++attempt) {
    axes = box({"corrections", "--json"}).object()["axes"];
    if (axes[0]["referenced"] == true && axes[2]["referenced"] == true) break;
    std::this_thread::sleep_for(20ms);
  }
  const double x_mm = axes[0]["position_mm"].get<double>() + 0.25, z_mm = axes[2]["position_mm"].get<double>();
  const auto homed = box({"home", "X=" + std::to_string(x_mm), "z=" + std::to_string(z_mm), "--json"});
  ASSERT_EQ(homed.status, 0) << homed.err;
  EXPECT_NEAR(homed.object()["homed"]["X"]["position_mm"].get<double>(), x_mm, 0.01);
  EXPECT_FALSE(homed.object()["homed"].contains("Y"));
  EXPECT_THAT(box({"home", "X=" + std::to_string(x_mm)}).out, HasSubstr("axis X"));

  const auto outside = box({"home", "Z=5000"});
  EXPECT_EQ(outside.status, 4);
  EXPECT_THAT(outside.err, HasSubstr("axis Z"));
  EXPECT_EQ(box({"home", "X=1", "X=2"}).status, 2) << "which of the two?";
}

}  // namespace
}  // namespace probebox::command
