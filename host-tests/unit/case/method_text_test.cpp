#include "tools/case/method_text.hpp"

#include <algorithm>
#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <sstream>

#include "firmware/metrology/methods.hpp"

namespace probebox::casefolder {
namespace {

using testing::HasSubstr;

TEST(Methods, AreListedOneALine) {
  std::ostringstream out, err;
  EXPECT_EQ(explainMethods({}, false, out, err), 0);
  const std::string text = out.str();
  EXPECT_EQ(static_cast<std::size_t>(std::ranges::count(text, '\n')), metrology::allMethods().size());
  EXPECT_THAT(text, HasSubstr("delay-plates"));
}

TEST(Methods, ExplainTheirTablesAndKeys) {
  std::ostringstream out, err;
  EXPECT_EQ(explainMethods(std::vector<std::string>{"delay-plates"}, false, out, err), 0);
  EXPECT_THAT(out.str(), HasSubstr("touch,nx,ny,nz,ux,uy,uz,speed_mm_s"));
  EXPECT_THAT(out.str(), HasSubstr("(needed)"));
  EXPECT_THAT(out.str(), HasSubstr("sd_gap_mm"));
}

TEST(Methods, ExplainThemselvesToPrograms) {
  std::ostringstream out, err;
  EXPECT_EQ(explainMethods(std::vector<std::string>{"screw-calibration"}, true, out, err), 0);
  const auto json = nlohmann::json::parse(out.str());
  EXPECT_EQ(json["tables"][1]["name"], "sector_cal");
  EXPECT_EQ(json["keys"][0]["needed"], true);
  EXPECT_EQ(json["keys"][4]["default"], "0.1");
  EXPECT_EQ(json["type_b_keys"], (std::vector<std::string>{"sd_screw_length_mm", "sd_orgoff_mm"}));
}

TEST(Methods, AreNotGuessed) {
  std::ostringstream out, err;
  EXPECT_EQ(explainMethods(std::vector<std::string>{"delay-plate"}, true, out, err), 2);
  EXPECT_THAT(err.str(), HasSubstr("'delay-plate'"));
  EXPECT_EQ(out.str(), "");
}

// A method that is in no list, described here: everything that solve() does around a solver comes from the descriptor.
constexpr metrology::MethodKey kKeys[]{{"length_mm", metrology::kNeeded, "of the rod"}};
constexpr metrology::KnownQuantity kKnown[]{{"sd_length_mm", "length_mm", metrology::KnownKind::value}};
constexpr std::string_view kUnobservable[]{"its bend"};

metrology::Solved solveRod(const metrology::Dataset& dataset) {
  metrology::Result result;
  result.method = dataset.method;
  const double length = std::get<double>(dataset.config.find("length_mm")->second);
  result.estimates.push_back(metrology::Estimate::scalar("twice_mm", 2.0 * length, 0.003));
  return result;
}

TEST(Methods, NeedNothingButADescriptor) {
  const metrology::Method rod{.name = "rod",
                              .title = "A rod",
                              .equations = {},
                              .source = {},
                              .solver = solveRod,
                              .tables = {},
                              .keys = kKeys,
                              .known = kKnown,
                              .results = {},
                              .unobservable = kUnobservable};
  const metrology::Dataset dataset{
      .method = "rod", .config = {{"length_mm", 100.0}, {"lenght_mm", 1.0}, {"sd_length_mm", 0.002}}, .tables = {}};
  const auto solved = metrology::solve(dataset, rod);
  ASSERT_TRUE(solved) << solved.error().reason;
  EXPECT_THAT(solved->warnings, testing::ElementsAre(testing::AllOf(HasSubstr("'lenght_mm'"), HasSubstr("rod"))));
  EXPECT_THAT(solved->unobservable, testing::ElementsAre("its bend"));
  EXPECT_NEAR(solved->estimates[0].uncertainty[0], 0.005, 1e-12) << "root of 0.003^2 and (2 x 0.002)^2";
}

}  // namespace
}  // namespace probebox::casefolder
