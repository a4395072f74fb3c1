#include <cmath>
#include <fstream>
#include <gmock/gmock.h>
#include <string>
#include <vector>

#include "board/describe/sim_files.hpp"
#include "host-tests/support/runs.hpp"
#include "on_the_machine.hpp"

// What `probebox plan` promises, beside what a run on the emulated machine then states.
namespace probebox::command {
namespace {

using testing::AllOf;
using testing::Gt;
using testing::Lt;

class Forecasts : public OnTheMachine {
 protected:
  using Words = std::vector<std::string>;
  // A run estimates its noise from some thirty residuals; its stamps jitter, which no forecast counts with.
  const testing::Matcher<double> about_one = AllOf(Gt(0.6), Lt(1.9));

  static Words joined(Words first, const Words& more) {
    first.insert(first.end(), more.begin(), more.end());
    return first;
  }
  nlohmann::ordered_json forecast(const Words& words) {
    const auto expected = box(joined({"plan", "--json"}, words));
    EXPECT_EQ(expected.status, 0) << expected.err;
    return expected.object();
  }
  nlohmann::ordered_json result(const Words& words) {
    const auto done = box(joined({"calibrate", "--json"}, words));
    EXPECT_EQ(done.status, 0) << done.err;
    for (const auto& object : done.objects()) {
      if (object.contains("result")) return object;
    }
    ADD_FAILURE() << "no result in " << done.out;
    return {};
  }
  // Root mean square of the sd of a run over those of its forecast, value by value.
  double runOverForecast(const Words& words) {
    const auto promised = forecast(words)["sd"], stated = result(words)["sd"];
    double squares = 0, count = 0;
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
  EXPECT_THAT(runOverForecast({"delay-multi-speed", "--speed", "20,40"}), about_one);
  ASSERT_EQ(box({"calibrate", "--speed", "20,40", "--accept", "--by", "Ada"}).status, 0);
  EXPECT_THAT(runOverForecast({"centreline", "--angles", "3"}), about_one);
  EXPECT_THAT(runOverForecast({"tool-setter", "--tool", "4"}), about_one);
  if (!runsAreComplete()) return;
  EXPECT_THAT(runOverForecast({"spindle-offset-four"}), about_one);
  EXPECT_THAT(runOverForecast({"periodic-check"}), about_one);
  EXPECT_THAT(runOverForecast({"rotary-axis-errors", "--angles", "6"}), about_one);
  // A forecast counts with the shortest hold, and 0.75 +- 0.1 is usual: the noise is learned from 27 residuals.
  EXPECT_THAT(runOverForecast({"sensor-head-calibration"}), AllOf(Gt(0.4), Lt(1.2)));
}

double firstOf(const nlohmann::ordered_json& value) {
  return value.is_array() ? value.at(0).get<double>() : value.get<double>();
}

// With a probe that is three times as noisy as usual, a sphere whose diameter is known to 0.4 um (k = 1), a stylus ball
// to 0.3 um and both to half a kelvin.
TEST_F(Forecasts, OfABoxHoldItsNoiseAsTheRunDoes) {
  start([](board::Descriptions& changed) {
    changed.probe.noise_um *= 3;
    changed.world->probe.noise_um *= 3;
    changed.probe.sd_ball_diameter_mm = 0.0003;
    auto& machine = changed.machine;
    machine.datum_sphere_certificate = board::CalibratedSphere{.serial_number = "K-1",
                                                               .diameter_mm = *machine.datum_sphere_diameter_mm,
                                                               .expanded_uncertainty_um = 0.8,
                                                               .coverage_factor = 2,
                                                               .certificate = "2026-0417",
                                                               .laboratory = "Laboratory",
                                                               .date = "2026-04-17",
                                                               .next_due = "2999-04-17"};
    machine.datum_sphere_temperature = board::SphereTemperature{.celsius = 20, .sd_k = 0.5, .expansion_per_k = 11.5e-6};
  });
  const auto expected = forecast({"delay-known-sphere"});
  const auto stated = result({"delay-known-sphere"});
  // No size goes into the delay: what u holds beside the noise is the same small rest in run and forecast.
  const double promised_s = firstOf(expected["u"]["tau_s"]), stated_s = firstOf(stated["u"]["tau_s"]);
  EXPECT_THAT(stated_s / promised_s, about_one);
  // Without the box's noise the sd would be forecast three times as small.
  EXPECT_THAT(firstOf(stated["sd"]["tau_s"]) / firstOf(expected["sd"]["tau_s"]), about_one);
  const auto usual = probebox({"plan", "--json", "delay-known-sphere"}).object();
  EXPECT_GT(firstOf(stated["sd"]["tau_s"]) / firstOf(usual["sd"]["tau_s"]), 1.8);
}

TEST_F(Forecasts, SayForWhichMachineTheyAre) {
  using testing::HasSubstr;
  using testing::Not;
  const auto of_box = box({"plan", "centreline"});
  EXPECT_THAT(of_box.out, AllOf(HasSubstr("SIM-PROBE-1"), HasSubstr("tcp:127.0.0.1"), HasSubstr("refused: centreline"),
                                HasSubstr("box: "), Not(HasSubstr("stylus ball of"))))
      << of_box.err;
  const auto machine = forecast({"centreline"})["machine"];
  EXPECT_NEAR(machine["deflections_hz"].get<double>(), 2000, 20);
  EXPECT_NEAR(machine["positions_hz"].get<double>(), 1000, 10);
  EXPECT_EQ(machine["deflections_noise_um"], 0.4);

  const auto path = directory_.file("machine.toml");
  std::string text{board::simFile("machine.toml")};
  const std::string name = "emulated three-axis mill";
  text.replace(text.find(name), name.size(), "another mill");
  std::ofstream{path} << text;
  EXPECT_THAT(box({"plan", "centreline", "--machine", path}).out,
              AllOf(HasSubstr("for another mill, as " + path +
                              " says in the place of emulated three-axis mill of the "
                              "box tcp:127.0.0.1:"),
                    HasSubstr("SIM-PROBE-1")));
}

// The error of the delay in force is in the radius of the ball that is checked.
TEST_F(Forecasts, HoldTheDelayInForce) {
  const auto before = forecast({"periodic-check"});
  EXPECT_THAT(before["in_u"].get<Words>(), testing::Not(testing::Contains("sd_effective_ball_radius_mm")));
  ASSERT_EQ(box({"calibrate", "--accept", "--by", "Ada"}).status, 0);
  const auto after = forecast({"periodic-check"});
  EXPECT_THAT(after["in_u"].get<Words>(), testing::Contains("sd_effective_ball_radius_mm"));
  EXPECT_EQ(after["machine"]["why_refused"], nullptr);
}

}  // namespace
}  // namespace probebox::command
