#include <cmath>
#include <string>

#include "on_the_machine.hpp"

// Delays that are measured along one axis, through the real programs: they come into force for that axis and no other.
namespace probebox::command {
namespace {

class AlongOneAxis : public OnTheMachine {
 protected:
  AlongOneAxis() : OnTheMachine{4} {}
  // Runs the method, compares its delay with the true one, accepts it, and returns what is in force then.
  nlohmann::ordered_json inForceAfter(std::vector<std::string> run, std::size_t axis) {
    run.insert(run.begin(), "calibrate");
    run.emplace_back("--json");
    const auto measured = box(run);
    EXPECT_EQ(measured.status, 0) << measured.err;
    nlohmann::ordered_json proposed;
    for (const auto& object : measured.objects()) {
      if (object.contains("result")) proposed = object;
      if (object.value("state", "") == "running") normal_ = object["outward_normal"];
    }
    if (proposed.is_null()) return {};
    const auto& delays = descriptions_.world->delays;
    const double truth_s = delays.tau_machine_s.at(axis) - delays.tau_probe_s;
    const double tau_s = proposed["result"]["tau_s"], sd_s = proposed["sd"]["tau_s"];
    EXPECT_LT(std::abs(tau_s - truth_s), 5 * sd_s) << tau_s << " instead of " << truth_s;
    EXPECT_LT(sd_s, 6e-5);
    sd_s_ = sd_s;
    const auto accepted = box({"accept", std::to_string(proposed["id"].get<int>()), "--by", "Ada"});
    EXPECT_EQ(accepted.status, 0) << accepted.err;
    return box({"info", "--json"}).object()["delay"];
  }
  // What is in force for one axis, and for no other.
  static void expectForOne(const nlohmann::ordered_json& delay, std::size_t axis) {
    for (std::size_t k = 0; k < 3; ++k) EXPECT_EQ(delay["sd_s"][k] > 0, k == axis) << "XYZ"[k];
  }

  nlohmann::ordered_json normal_;
  double sd_s_{};
};

TEST_F(AlongOneAxis, PlatesTellTheDelayOfTheAxisAcrossWhichTheyStand) {
  start([](board::Descriptions& all) { all.world->delays.tau_machine_s = {0.0045, 0.0052, 0.0061}; });
  expectForOne(inForceAfter({"delay-plates", "--axis", "Y"}, 1), 1);
  EXPECT_NE(box({"calibrate", "delay-plates", "--axis", "B"}).status, 0);
  EXPECT_NE(box({"calibrate", "delay-cube", "--axis", "Y"}).status, 0) << "its faces are across all of them";
}

TEST_F(AlongOneAxis, AProbeThatDoesNotTouchTellsTheDelayOfItsOwn) {
  start([](board::Descriptions& all) {
    all.world->delays.tau_machine_s = {0.0045, 0.0052, 0.0061};
    all.probe.by_distance = all.world->distance_probe = board::ProbeDistance{.stand_off_mm = 20, .range_mm = 2};
    all.probe.ball_diameter_mm = all.world->sphere.stylus_ball_radius_mm = 0;
    all.probe.gain = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  });
  EXPECT_NE(box({"calibrate", "delay-multi-speed"}).status, 0) << "it touches";
  EXPECT_NE(box({"calibrate", "delay-in-out", "--clearance", "3"}).status, 0) << "it leaves the range";
  const auto plan = box({"plan", "delay-in-out", "--json"});
  ASSERT_EQ(plan.status, 0) << plan.err;
  const double forecast_s = plan.object()["sd"]["tau_s"];
  expectForOne(inForceAfter({"delay-in-out"}, 2), 2);
  EXPECT_EQ(normal_, nlohmann::ordered_json({0.0, 0.0, 1.0}));
  EXPECT_GT(sd_s_, forecast_s / 3);
  EXPECT_LT(sd_s_, forecast_s * 3);
}

}  // namespace
}  // namespace probebox::command
