#include "firmware/json/dataset_json.hpp"

#include <cmath>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <limits>
#include <numbers>

// What the box keeps and sends of a calibration, and what the command makes of it.
namespace probebox::json {
namespace {

using metrology::Dataset;

TEST(DatasetJson, ComesBackAsItWas) {
  Dataset sent = metrology::touchDataset("delay-multi-speed");
  sent.config["sigma_mm"] = 0.1 + 0.2;
  sent.config["label"] = std::string{"\"no. 1\", 20 \u00b0C"};
  sent.config["at_rest"] = true;
  sent.config["speeds_mm_s"] = std::vector<double>{5, 1e-300, -0.0};
  sent.config["none"] = std::vector<double>{};
  sent.config["gain_matrix"] = metrology::Matrix{{1, 0, 0.5}, {0, std::numbers::pi, 0}};
  sent.tables[0].append(
      {0, 1.0 / 3, std::numeric_limits<double>::denorm_min(), std::numeric_limits<double>::max(), -20.0 / 3});

  const auto got = datasetFromJson(toJson(sent));
  ASSERT_TRUE(got) << got.error().what;
  EXPECT_EQ(*got, sent);
  EXPECT_TRUE(std::signbit(std::get<std::vector<double>>(got->config.at("speeds_mm_s"))[2]));
}

TEST(DatasetJson, IsWrittenAsTheFormatSays) {
  const Dataset sent{.method = "centreline",
                     .config = {{"at_rest", true}, {"gain", metrology::Matrix{{1, 2}, {3, 4.5}}}, {"sigma_mm", 1e-3}},
                     .tables = {{.name = "readings", .columns = {{"C_rad", {0, -0.0}}, {"x_mm", {1e22, 7}}}}}};
  EXPECT_EQ(toJson(sent),
            R"({"method":"centreline","config":{"at_rest":true,"gain":[[1.0,2.0],[3.0,4.5]],"sigma_mm":0.001},)"
            R"("tables":[{"name":"readings","columns":[{"name":"C_rad","values":[0.0,-0.0]},)"
            R"({"name":"x_mm","values":[1e+22,7.0]}]}]})");
}

TEST(DatasetJson, KeepsWhatIsNoNumber) {
  Dataset sent = metrology::touchDataset("delay-multi-speed");
  sent.tables[0].append({0, 1, std::numeric_limits<double>::quiet_NaN(), 3, 4});
  const auto got = datasetFromJson(toJson(sent));
  ASSERT_TRUE(got) << got.error().what;
  EXPECT_TRUE(std::isnan(got->tables[0].columns[2].values[0]));
  EXPECT_EQ(got->tables[0].columns[3].values[0], 3);
}

TEST(DatasetJson, OfAnotherVersionIsRefusedWithARemedy) {
  const std::string whole = toJson(metrology::touchDataset("delay-multi-speed"));
  for (const auto& text : {std::string{}, std::string{"{}"}, whole.substr(0, whole.size() / 2)}) {
    const auto got = datasetFromJson(text);
    ASSERT_FALSE(got) << text;
    EXPECT_THAT(got.error().what, testing::HasSubstr("older"));
  }
}

// Names become those of files and of columns.
TEST(DatasetJson, TakesNoNameThatLeadsOutOfItsFolder) {
  for (const auto* name : {"../../.profile", "/etc/cron", "a b", "=HYPERLINK", "", "a\nb"}) {
    Dataset sent = metrology::touchDataset("delay-multi-speed");
    sent.tables[0].name = name;
    ASSERT_FALSE(datasetFromJson(toJson(sent))) << name;
    EXPECT_THAT(datasetFromJson(toJson(sent)).error().what, testing::HasSubstr("letters, digits"));
    sent = metrology::touchDataset("delay-multi-speed");
    sent.tables[0].columns[1].name = name;
    EXPECT_FALSE(datasetFromJson(toJson(sent))) << name;
  }
}

}  // namespace
}  // namespace probebox::json
