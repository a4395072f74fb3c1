#include <cmath>
#include <gmock/gmock.h>
#include <string>
#include <vector>

#include "on_the_machine.hpp"

// What `probebox plan` promises, beside what a run on the emulated machine then states.
namespace probebox::command {
namespace {

class Forecasts : public OnTheMachine {
 protected:
  // Root mean square of the sd of a run over those of its forecast, value by value.
  double runOverForecast(const std::vector<std::string>& words) {
    std::vector<std::string> plan{"plan", "--json"}, run{"calibrate", "--json"};
    plan.insert(plan.end(), words.begin(), words.end());
    run.insert(run.end(), words.begin(), words.end());
    const auto expected = probebox(plan);
    EXPECT_EQ(expected.status, 0) << expected.err;
    const auto done = box(run);
    EXPECT_EQ(done.status, 0) << done.err;
    nlohmann::ordered_json stated;
    for (const auto& object : done.objects()) {
      if (object.contains("result")) stated = object["sd"];
    }
    double squares = 0, count = 0;
    const auto promised = expected.object()["sd"];
    for (const auto& [key, sd] : promised.items()) {
      EXPECT_TRUE(stated.contains(key)) << key << " is not in " << stated;
      if (!stated.contains(key) || sd.get<double>() == 0) continue;
      squares += std::pow(stated[key].get<double>() / sd.get<double>(), 2);
      ++count;
    }
    EXPECT_GT(count, 0);
    return std::sqrt(squares / count);
  }
};

// The emulated machine has the noise that a forecast assumes, and stamps that jitter, stops that are off and a probe
// with cross talk, which it does not.
TEST_F(Forecasts, AreWhatRunsOnTheMachineState) {
  using testing::AllOf;
  using testing::Gt;
  using testing::Lt;
  const auto about_one = AllOf(Gt(0.6), Lt(1.7));
  EXPECT_THAT(runOverForecast({"delay-multi-speed", "--speed", "20,40"}), about_one);
  ASSERT_EQ(box({"calibrate", "--speed", "20,40", "--accept", "--by", "Ada"}).status, 0);
  EXPECT_THAT(runOverForecast({"centreline", "--angles", "3"}), about_one);
  EXPECT_THAT(runOverForecast({"spindle-offset-four"}), about_one);
  EXPECT_THAT(runOverForecast({"tool-setter", "--tool", "4"}), about_one);
  // A forecast counts with the shortest hold, and 0.75 +- 0.1 is usual: the noise is learned from 27 residuals.
  EXPECT_THAT(runOverForecast({"sensor-head-calibration"}), AllOf(Gt(0.4), Lt(1.2)));
}

}  // namespace
}  // namespace probebox::command
