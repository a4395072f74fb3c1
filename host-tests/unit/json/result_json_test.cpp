#include "firmware/json/result_json.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

// A result may come from another computer: what its sizes promise is checked where it is read.
namespace probebox::json {
namespace {

using Json = nlohmann::ordered_json;
using metrology::Estimate;

metrology::Result aResult() {
  metrology::Result result;
  result.method = "sphere-fit";
  result.estimates = {Estimate::vector("centre_mm", {1, 2}, {0.1, 0.2}), Estimate::scalar("radius_mm", 3, 0.3),
                      Estimate::matrix("gain", 2, {1, 0, 0, 1}, {})};
  result.covariance = metrology::Covariance{{"x", "y"}, {1, 0, 0, 1}};
  return result;
}

TEST(ResultJson, GivesBackTheSameResult) {
  const auto again = resultFromJson(toJson(aResult()));
  ASSERT_TRUE(again) << again.error().what;
  EXPECT_EQ(again->estimates, aResult().estimates);
  EXPECT_EQ(again->covariance->values, aResult().covariance->values);
}

TEST(ResultJson, RefusesListsThatDoNotGoTogether) {
  struct Change {
    const char* where;
    Json value;
  };
  const auto changes = std::vector<Change>{
      {"/covariance/values", Json::array()},
      {"/covariance/values", {1, 0, 0}},
      {"/covariance/components", {"x", "y", "z"}},
      {"/estimates/0/sd", {0.1}},
      {"/estimates/0/design", {0.1, 0.2, 0.3}},
      {"/estimates/0/uncertainty", {0.1}},
      {"/estimates/1/values", Json::array()},
      {"/estimates/1/values", {1, 2}},
      {"/estimates/2/columns", 0},
      {"/estimates/2/columns", 3},
      {"/estimates/2/shape", 3},
      {"/estimates", Json::array()},
  };
  for (const auto& [where, value] : changes) {
    auto json = Json::parse(toJson(aResult()));
    json[Json::json_pointer{where}] = value;
    const auto refused = resultFromJson(json.dump());
    ASSERT_FALSE(refused) << where << " " << value;
    EXPECT_THAT(refused.error().what, testing::HasSubstr("cannot")) << where;
  }
}

}  // namespace
}  // namespace probebox::json
