// What the answer of delay-feature says besides the delay: design figure, what is stated about sizes, clipped touches.
#include <algorithm>
#include <cmath>
#include <functional>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <map>
#include <string>

#include "host-tests/metrology/cases.hpp"
#include "host-tests/metrology/touch_simulation.hpp"

namespace probebox::metrology {
namespace {

using simulation::Scene;
using testing::Contains;
using testing::HasSubstr;

constexpr double kSpeed = 25.0;  // mm/s
constexpr double kSize = 31.0;   // of the sphere, and of the box that its touches along the axes could be of
using Config = std::map<std::string, Value, std::less<>>;

Scene fiveSides(std::vector<double> speeds = {kSpeed}) {
  Scene scene = simulation::knownSphere();
  scene.normals = {{1, 0, 0}, {-1, 0, 0}, {0, 1, 0}, {0, -1, 0}, {0, 0, 1}};
  scene.speeds_mm_s = std::move(speeds);
  return scene;
}

Dataset touched(const Scene& scene, Config config) {
  std::mt19937_64 random{91};
  Dataset dataset = simulation::measure(scene, random);
  dataset.method = "delay-feature";
  dataset.config = std::move(config);
  stateExactMachine(dataset);
  return dataset;
}

Result answerOf(const Dataset& dataset) {
  auto solved = solve(dataset);
  EXPECT_TRUE(solved.ok()) << solved.error().reason;
  return std::move(solved).value();
}

Result on(Config config, Config more) {
  config.merge(more);
  return answerOf(touched(fiveSides(), std::move(config)));
}

const Config kSphere{{"shape", "sphere"}, {"size_mm", kSize}};
const Config kBox{{"shape", "box"}, {"size_axis_mm", std::vector{kSize, kSize, kSize}}};

TEST(FeatureAnswer, HasTheDesignFigureOfTheSpeed) {
  const Result result = on(kSphere, {});
  EXPECT_NEAR(result.designFigure().value(), 1.0 / (2.0 * kSpeed), 0.01 / (2.0 * kSpeed));
  EXPECT_THAT(result.design_per, HasSubstr("one touch"));
  EXPECT_NEAR(result.find("centre_mm")->design.at(0), 1.0 / std::sqrt(2.0), 0.01) << "an opposed pair";
}

TEST(FeatureAnswer, HasAResidualForEveryTouch) {
  Scene scene = fiveSides();
  scene.normals.push_back({0.6, 0.8, 0});
  const Result result = answerOf(touched(scene, kSphere));
  ASSERT_EQ(result.residuals.values.size(), 6U);
  EXPECT_EQ(result.residuals.names[5], "touch 5");
  double squares = 0.0;
  for (const double value : result.residuals.values) squares += value * value;
  EXPECT_NEAR(std::sqrt(squares / 6.0), result.rms, 1e-12);
  for (const double speed : result.residuals.at) EXPECT_NEAR(speed, kSpeed, 0.01 * kSpeed);
  // Read minus fitted: a touch that stands out stands up.
  Dataset dataset = touched(scene, kSphere);
  const auto touches = columnNamed(dataset, "machine", "touch");
  auto& x = columnNamed(dataset, "machine", "x_mm");
  for (std::size_t row = 0; row < x.size(); ++row) x[row] += touches[row] == 5.0 ? 0.003 : 0.0;
  EXPECT_GT(answerOf(dataset).residuals.values[5], result.residuals.values[5] + 0.0005);
}

TEST(FeatureAnswer, HasTheCovarianceOfWhatItPromises) {
  const Result result = answerOf(touched(fiveSides({10.0, 30.0}), {{"shape", "sphere"}}));
  ASSERT_TRUE(result.covariance);
  EXPECT_EQ(result.covariance->components, (std::vector<std::string>{"tau_s", "size_mm"}));
  const auto& values = result.covariance->values;
  EXPECT_NEAR(std::sqrt(values[0]), result.find("tau_s")->sd[0], 1e-12);
  EXPECT_NEAR(std::sqrt(values[3]), result.find("size_mm")->sd[0], 1e-9);
  EXPECT_EQ(values[1], values[2]);
  EXPECT_GT(values[1], 0.5 * std::sqrt(values[0] * values[3])) << "a late machine makes a sphere small (A10)";
  auto each_axis = kSphere;
  each_axis["delays"] = std::string{"each-axis"};
  const Result axes = answerOf(touched(fiveSides({10.0, 30.0}), each_axis));
  EXPECT_THAT(axes.covariance->components, Contains("tau_axis_s[2]"));
}

// (A9): d tau = dd / (2 S).
TEST(FeatureAnswer, PutsWhatIsStatedAboutSizesIntoTheBudget) {
  const double width = 2.0 * kSpeed;
  const auto sdOf = [](const Result& result, const std::string& name) {
    const auto line = std::ranges::find(result.budget, name, &Contribution::name);
    return line == result.budget.end() ? std::nan("") : line->sd[0];
  };
  const Result sphere = on(kSphere, {{"sd_size_mm", 1e-3}});
  EXPECT_NEAR(sdOf(sphere, "sd_size_mm"), 1e-3 / width, 1e-3 * 1e-3 / width);
  EXPECT_EQ(sphere.warnings, on(kSphere, {}).warnings) << "the key is used";
  // x and y tell the delay, half each; z has no opposite side.
  const Result box = on(kBox, {{"sd_size_axis_mm", 1e-3}});
  EXPECT_NEAR(sdOf(box, "sd_size_axis_mm"), 1e-3 / width / std::sqrt(2.0), 0.02 * 1e-3 / width);
}

TEST(FeatureAnswer, TakesSizesToTheTemperatureAtWhichTheyWereTouched) {
  constexpr double kExpansion = 11.5e-6;
  const double larger = kSize * kExpansion * 4.0 / (2.0 * kSpeed);  // s
  for (const auto& config : {kSphere, kBox}) {
    const double cold = on(config, {}).find("tau_s")->value();
    const Result warm =
        on(config, {{"temperature_c", 24.0}, {"expansion_per_k", kExpansion}, {"sd_temperature_k", 1.0}});
    EXPECT_NEAR(warm.find("tau_s")->value() - cold, larger, 0.01 * larger);
    ASSERT_EQ(warm.budget.size(), 2U);
    EXPECT_NEAR(warm.budget[1].sd[0], larger / 4.0, 0.01 * larger);
  }
}

TEST(FeatureAnswer, SaysWhatOneSpeedCannotTell) {
  EXPECT_THAT(on(kSphere, {}).unobservable, Contains(testing::AllOf(HasSubstr("1 um of size"), HasSubstr("20 us"))));
  const Result several = answerOf(touched(fiveSides({10.0, 30.0}), kSphere));
  EXPECT_THAT(several.unobservable, testing::Not(Contains(HasSubstr("1 um of size"))));
}

void clip(Dataset& dataset, const std::function<bool(double)>& touch) {
  const auto touches = columnNamed(dataset, "probe", "touch");
  for (const auto* channel : {"a", "b", "c"}) {
    auto& values = columnNamed(dataset, "probe", channel);
    for (std::size_t row = 0; row < values.size(); ++row) {
      if (touch(touches[row])) values[row] = std::clamp(values[row], -0.3, 0.3);
    }
  }
}

TEST(FeatureAnswer, LeavesOutTouchesWhoseDeflectionWasLimited) {
  for (const double threshold_mm : {0.0, 0.1}) {
    Scene scene = fiveSides();
    scene.normals.push_back({0.6, 0.8, 0});
    Dataset dataset = touched(scene, kSphere);
    if (threshold_mm > 0.0) dataset.config["threshold_mm"] = threshold_mm;
    EXPECT_TRUE(answerOf(dataset).dropped.empty());
    clip(dataset, [](double touch) { return touch == 2.0; });
    const Result result = answerOf(dataset);
    ASSERT_EQ(result.dropped.size(), 1U);
    EXPECT_EQ(result.dropped[0].name, "touch 2");
    EXPECT_EQ(result.dropped[0].reason, "clipped");
    EXPECT_THAT(result.warnings, Contains(HasSubstr("overtravel")));
    EXPECT_NEAR(result.find("tau_s")->value(), scene.tau(), 4.5 * result.find("tau_s")->sd[0]);
    clip(dataset, [](double touch) { return touch <= 2.0; });
    EXPECT_EQ(refusalOf(dataset), "clipped");
  }
}

}  // namespace
}  // namespace probebox::metrology
