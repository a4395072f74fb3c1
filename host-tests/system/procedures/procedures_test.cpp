#include <algorithm>
#include <cmath>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <iterator>

#include "host-tests/support/runs.hpp"
#include "on_the_machine.hpp"
#include "tools/probebox/link/box.hpp"

namespace probebox::command {
namespace {

using testing::AnyOf;
using testing::HasSubstr;

TEST_F(OnTheMachine, CalibratesTheDelayThenTheAxisThatTurns) {
  const auto early = box({"calibrate", "centreline"});
  EXPECT_EQ(early.status, 4);
  EXPECT_THAT(early.err, HasSubstr("calibrate"));

  const auto delay = box({"calibrate", "--speed", "20,40", "--accept", "--by", "somebody"});
  ASSERT_EQ(delay.status, 0) << delay.err;
  // The machine is quick, so not every step is seen.
  EXPECT_THAT(delay.out, HasSubstr(" of 10: "));
  EXPECT_THAT(delay.out, HasSubstr("0.5 mm"));
  EXPECT_THAT(delay.out, AnyOf(testing::AllOf(HasSubstr("20 mm/s"), HasSubstr("1.5 mm")),
                               testing::AllOf(HasSubstr("40 mm/s"), HasSubstr("1.5 mm"))));

  const auto saved = directory_.file("axis");
  const auto axis = box({"calibrate", "centreline", "--angles", "3", "--save", saved, "--json"});
  ASSERT_EQ(axis.status, 0) << axis.err;
  nlohmann::ordered_json proposed, step;
  for (const auto& object : axis.objects()) {
    if (object.contains("result")) proposed = object;
    if (object.contains("prompt") && object["steps"] == 20 && object["step"] < 15) step = object;
  }
  ASSERT_FALSE(proposed.is_null()) << axis.out;
  EXPECT_EQ(step["feature"], "part_ball");
  EXPECT_EQ(step["ball"], 1);
  EXPECT_NEAR(step["rotary_angles_rad"][2].get<double>(), (step["step"].get<int>() / 5) * 2 * M_PI / 3, 1e-12);

  const auto& spindle = descriptions_.world->part_spindle;
  const double x_mm = spindle.point_mm[0] + spindle.direction[0] * spindle.balls_mm[0][2] -
                      descriptions_.world->probe_spindle.stylus_offset_mm[0];
  const auto found = proposed["result"]["centre_mm[0]"], sd = proposed["sd"]["centre_mm[0]"];
  EXPECT_LT(std::abs(found.get<double>() - x_mm), 5 * sd.get<double>());

  // The saved case solves to the same digits.
  const auto solved = probebox({"solve", "--json", saved});
  ASSERT_EQ(solved.status, 0) << solved.out << solved.err;
  EXPECT_EQ(solved.object()["result"]["centre_mm"][0], found);
  EXPECT_EQ(solved.object()["sd"]["centre_mm"][0], sd);
}

// Methods whose run B takes part in, each after a delay that is in force.
class WithADelay : public OnTheMachine {
 protected:
  void measureDelay() {
    const auto delay = box({"calibrate", "--speed", "20,40", "--accept", "--by", "somebody"});
    ASSERT_EQ(delay.status, 0) << delay.err;
  }
  // What a run proposes. Its saved case gives the same digits.
  nlohmann::ordered_json proposedBy(const std::string& method, const std::string& key,
                                    const std::vector<std::string>& options = {}) {
    const auto saved = directory_.file(method + std::to_string(options.size()));
    std::vector<std::string> arguments{"calibrate", method, "--save", saved, "--json"};
    arguments.insert(arguments.end(), options.begin(), options.end());
    const auto run = box(arguments);
    EXPECT_EQ(run.status, 0) << run.err;
    nlohmann::ordered_json proposed;
    for (const auto& object : run.objects()) {
      if (object.contains("result")) proposed = object;
      if (object.value("b_moves", "nothing") != "nothing") b_moves_ = object["b_moves"];
    }
    EXPECT_FALSE(proposed.is_null()) << run.out;
    if (proposed.is_null()) return proposed;
    const auto solved = probebox({"solve", "--json", saved});
    EXPECT_EQ(solved.status, 0) << solved.out << solved.err;
    const auto values = flat(solved.object()["result"][key]), sds = flat(solved.object()["sd"][key]);
    EXPECT_GE(values.size(), 2U);
    for (std::size_t i = 0; i < values.size(); ++i) {
      const auto component = key + "[" + std::to_string(i) + "]";
      EXPECT_EQ(values[i], proposed["result"][component]);
      EXPECT_EQ(sds[i], proposed["sd"][component]);
    }
    return proposed;
  }
  // The numbers of a vector, or of a matrix row by row.
  static std::vector<nlohmann::ordered_json> flat(const nlohmann::ordered_json& value) {
    if (!value.is_array()) return {value};
    std::vector<nlohmann::ordered_json> numbers;
    for (const auto& part : value) {
      for (const auto& number : flat(part)) numbers.push_back(number);
    }
    return numbers;
  }

  std::string b_moves_;
};

TEST_F(WithADelay, FindsThePivotOfATableThatTilts) {
  EXPECT_THAT(box({"calibrate", "table-pivot"}).err, HasSubstr("calibrate"));
  ASSERT_NO_FATAL_FAILURE(measureDelay());
  const auto proposed = proposedBy("table-pivot", "pivot_yz_mm");
  ASSERT_FALSE(proposed.is_null());
  EXPECT_EQ(b_moves_, "table");
  const auto& world = *descriptions_.world;
  // The axis leans by little, and the readings lie about its point.
  const double y_mm = world.tilting_table->point_mm[1] - world.probe_spindle.stylus_offset_mm[1];
  EXPECT_NEAR(proposed["result"]["pivot_yz_mm[0]"].get<double>(), y_mm, 2e-3);

  start([](board::Descriptions& changed) { changed.machine.tilting_table.reset(); });
  EXPECT_THAT(box({"calibrate", "table-pivot"}).err,
              testing::AllOf(HasSubstr("[tilting_table]"), HasSubstr("tilts_deg")));
}

TEST_F(WithADelay, FindsWhatAHeadThatSwivelsIsOff) {
  ASSERT_NO_FATAL_FAILURE(measureDelay());
  const auto error = proposedBy("swivel-error", "error_at_queries_mm");
  ASSERT_FALSE(error.is_null());
  EXPECT_EQ(b_moves_, "head");
  const auto pivot = proposedBy("head-pivot", "pivot_xz_mm");
  ASSERT_FALSE(pivot.is_null());
  const auto& head = *descriptions_.world->swivel_head;
  EXPECT_NEAR(pivot["result"]["pivot_xz_mm[0]"].get<double>(), head.pivot_mm[0], 2e-3);
  if (runsAreComplete()) {
    const auto lean = proposedBy("a-axis-alignment", "A_tilt_rad");
    ASSERT_FALSE(lean.is_null());
    EXPECT_NEAR(lean["result"]["A_tilt_rad[1]"].get<double>(), descriptions_.world->probe_spindle.direction[1], 5e-5);
  }
  const auto by_shank = proposedBy("a-axis-alignment", "A_tilt_rad", {"--shank"});
  ASSERT_FALSE(by_shank.is_null());
  EXPECT_NEAR(by_shank["result"]["A_tilt_rad[1]"].get<double>(), descriptions_.world->probe_spindle.direction[1], 5e-5);
  const auto of_shank = box({"calibrate", "head-pivot", "--shank"});
  EXPECT_EQ(of_shank.status, 4);
  EXPECT_THAT(of_shank.err, testing::AllOf(HasSubstr("not use"), HasSubstr("shank")));

  start([](board::Descriptions& changed) { changed.machine.probe_shank.reset(); });
  EXPECT_THAT(box({"calibrate", "swivel-error", "--shank"}).err,
              testing::AllOf(HasSubstr("[probe_shank]"), HasSubstr("radius_mm")));

  start([](board::Descriptions& changed) { changed.machine.probe_tools.clear(); });
  EXPECT_THAT(box({"calibrate", "swivel-error"}).err, HasSubstr("[probe_tools]"));
}

// The box asks for more steps as it learns where the ball is.
TEST_F(WithADelay, GoesRoundABallOnTheRimUntilItIsOnTheLine) {
  ASSERT_NO_FATAL_FAILURE(measureDelay());
  const auto proposed = proposedBy("centreline-by-steps", "centre_mm");
  ASSERT_FALSE(proposed.is_null());
  const auto& spindle = descriptions_.world->part_spindle;
  const auto& probe = descriptions_.world->probe_spindle;
  // Where the axes are: that of the part as high as the ball, that of the probe as low as the stylus.
  const double x_mm =
      spindle.point_mm[0] + spindle.direction[0] * spindle.balls_mm[0][2] + probe.direction[0] * probe.stylus_length_mm;
  EXPECT_LT(std::abs(proposed["result"]["centre_mm[0]"].get<double>() - x_mm),
            5 * proposed["sd"]["centre_mm[0]"].get<double>());
  const auto saved = directory_.file("centreline-by-steps0");
  std::ifstream readings{saved + "/readings.csv"};
  EXPECT_EQ(std::count(std::istreambuf_iterator<char>{readings}, {}, '\n'), 1 + 5) << "two loops, and zero";

  start([](board::Descriptions& changed) { changed.machine.rim_ball.reset(); });
  EXPECT_THAT(box({"calibrate", "centreline-by-steps"}).err,
              testing::AllOf(HasSubstr("[rim_ball]"), HasSubstr("c_deg")));
}

TEST_F(OnTheMachine, WalksThroughItsFirstRun) {
  const auto good = box({"selftest"});
  EXPECT_EQ(good.status, 0) << good.out << good.err;
  EXPECT_THAT(good.out, HasSubstr("X counts"));
  EXPECT_THAT(good.out, HasSubstr("towards +Z"));
  EXPECT_THAT(good.out, testing::AllOf(HasSubstr("gpiochip0"), HasSubstr("line 11"), HasSubstr("loop-back")));
  EXPECT_THAT(good.out, testing::AllOf(HasSubstr("4000 ns"), HasSubstr("0 of"), HasSubstr("500 pulses")));
  EXPECT_THAT(good.out, HasSubstr("checks passed"));
  const auto status = box({"status", "--json"}).object();
  EXPECT_EQ(status["procedure"], "done") << "nothing waits to be accepted";
  EXPECT_EQ(box({"history"}).out, "") << "no calibration, so nothing is stored";

  start([](board::Descriptions& changed) {
    for (double& gain : changed.probe.gain[1]) gain = -gain;
  });
  const auto wrong = box({"selftest", "--json"});
  EXPECT_EQ(wrong.status, 1) << wrong.out;
  std::vector<std::string> names;
  for (const auto& object : wrong.objects()) {
    if (object.contains("good") && !object["good"].get<bool>()) names.push_back(object["name"]);
  }
  EXPECT_EQ(names, std::vector<std::string>{"probe-sign-wrong"});
  nlohmann::ordered_json late;
  for (const auto& object : wrong.objects()) {
    if (object.contains("loop_back")) late = object["loop_back"];
  }
  ASSERT_FALSE(late.is_null());
  EXPECT_GT(late["median_lateness_ns"], 12'000) << "the bias of world.toml alone";
  EXPECT_GT(late["sigma_ns"], 0);
  EXPECT_EQ(wrong.objects().back()["wrong"], 1);
}

TEST_F(OnTheMachine, CannotBePulsedTooSeldom) {
  std::istringstream in;
  std::ostringstream out, err;
  const std::atomic<bool> never{false};
  Console console{{in, out, err, false, false, 0, never}, false};
  const auto opened = openBox(daemon_->uris().front(), console);
  ASSERT_TRUE(opened);
  const auto refused = ask<messages::LoopBack>(**opened, console, {3});
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().status, ExitStatus::box_refused);
  EXPECT_THAT(refused.error().what, testing::AllOf(HasSubstr("10 to"), HasSubstr("2000")));
}

TEST_F(OnTheMachine, FindsTheFaceOfAScrewByTurningIt) {
  start([](board::Descriptions& changed) {
    auto& screw = changed.world->screws[0].value();
    screw.warm_um = screw.cold_um;
    screw.face_um = {3, 0.8};
  });
  const auto without_axis = box({"calibrate", "screw-calibration"});
  EXPECT_EQ(without_axis.status, 4);
  EXPECT_THAT(without_axis.err, HasSubstr("--axis"));
  EXPECT_THAT(box({"calibrate", "screw-calibration", "--axis", "X", "--turns", "2"}).err,
              testing::AllOf(HasSubstr("3 to"), HasSubstr("to 20")));
  EXPECT_THAT(box({"calibrate", "centreline", "--axis", "X"}).err, HasSubstr("options axis"));
  EXPECT_THAT(box({"calibrate", "delay-multi-speed", "--turns", "4"}).err,
              testing::AllOf(HasSubstr("axis and"), HasSubstr("turns")));
  const auto slow = box({"calibrate", "screw-calibration", "--axis", "X", "--turns", "20", "--speed", "0.1"});
  EXPECT_EQ(slow.status, 4);
  EXPECT_THAT(slow.err, HasSubstr("0.217 mm/s"));

  const auto saved = directory_.file("screw");
  const auto run =
      box({"calibrate", "screw-calibration", "--axis", "x", "--turns", "3", "--speed", "1", "--save", saved, "--json"});
  ASSERT_EQ(run.status, 0) << run.err;
  nlohmann::ordered_json proposed;
  for (const auto& object : run.objects()) {
    if (object.contains("result")) proposed = object;
  }
  ASSERT_FALSE(proposed.is_null()) << run.out;
  // The crests of the two harmonics stand in sectors of their own.
  double largest = 0, sum = 0;
  for (std::size_t i = 0; i < 24; ++i) {
    const double value = proposed["result"]["sector_table_um[" + std::to_string(i) + "]"];
    largest = std::max(largest, std::abs(value));
    sum += value;
  }
  EXPECT_GT(largest, 2.2);
  EXPECT_LT(largest, 3.8);
  EXPECT_NEAR(sum, 0, 1e-6);

  const auto solved = probebox({"solve", "--json", saved});
  ASSERT_EQ(solved.status, 0) << solved.out << solved.err;
  EXPECT_EQ(solved.object()["result"]["sector_table_um"][7], proposed["result"]["sector_table_um[7]"]);
  EXPECT_EQ(solved.object()["sd"]["sector_table_um"][7], proposed["sd"]["sector_table_um[7]"]);

  const auto accepted = box({"accept", std::to_string(proposed["id"].get<int>()), "--by", "somebody"});
  EXPECT_EQ(accepted.status, 0) << accepted.err;
  EXPECT_THAT(box({"history", "screw-x"}).out, HasSubstr("active"));
}

TEST_F(OnTheMachine, SetsAToolOnTheDeviceThatTheProbeHasMeasured) {
  EXPECT_THAT(box({"calibrate", "tool-setter"}).err, HasSubstr("--tool"));
  EXPECT_THAT(box({"calibrate", "tool-setter", "--tool", "4"}).err, HasSubstr("calibrate"));
  ASSERT_EQ(box({"calibrate", "--speed", "20,40", "--accept", "--by", "somebody"}).status, 0);
  EXPECT_THAT(box({"calibrate", "tool-setter", "--tool", "7"}).err,
              testing::AllOf(HasSubstr("[[tool]]"), HasSubstr("number 7")));

  const auto saved = directory_.file("tool");
  const auto run = box({"calibrate", "tool-setter", "--tool", "4", "--save", saved, "--json"});
  ASSERT_EQ(run.status, 0) << run.err;
  nlohmann::ordered_json proposed, with_tool;
  for (const auto& object : run.objects()) {
    if (object.contains("result")) proposed = object;
    if (object.contains("tool") && object["tool"] == 4) with_tool = object;
  }
  ASSERT_FALSE(proposed.is_null()) << run.out;
  EXPECT_EQ(with_tool["feature"], "tool_setter");
  EXPECT_THAT(with_tool["prompt"].get<std::string>(), HasSubstr("tool 4"));

  const auto& tool = *std::ranges::find(descriptions_.world->further_tools, 4U, &board::WorldTool::number);
  const auto found = proposed["result"]["tool_offset_mm[2]"], sd = proposed["sd"]["tool_offset_mm[2]"];
  EXPECT_LT(std::abs(found.get<double>() + tool.length_mm), 5 * sd.get<double>());
  EXPECT_LT(sd.get<double>(), 1e-3);

  const auto solved = probebox({"solve", "--json", saved});
  ASSERT_EQ(solved.status, 0) << solved.out << solved.err;
  EXPECT_EQ(solved.object()["result"]["tool_offset_mm"][2], found);
  EXPECT_EQ(solved.object()["sd"]["tool_offset_mm"][2], sd);
  EXPECT_TRUE(solved.object()["warnings"].empty()) << solved.out;

  const auto accepted = box({"accept", std::to_string(proposed["id"].get<int>()), "--by", "somebody"});
  EXPECT_EQ(accepted.status, 0) << accepted.err;
  EXPECT_THAT(box({"history", "tool-4"}).out, HasSubstr("active"));
}

TEST_F(OnTheMachine, CalibratesTheSensorHeadAndReadsThePlateWithIt) {
  const auto early = box({"calibrate", "rotary-axis-errors", "--head"});
  EXPECT_EQ(early.status, 4);
  EXPECT_THAT(early.err, HasSubstr("calibrate sensor-head-calibration"));
  const auto by_head = box({"calibrate", "centreline", "--head"});
  EXPECT_EQ(by_head.status, 4);
  EXPECT_THAT(by_head.err, testing::AllOf(HasSubstr("not use"), HasSubstr("sensor head")));
  EXPECT_THAT(box({"calibrate", "sensor-head-calibration", "--speed", "5"}).err, HasSubstr("no speeds"));

  // What a run proposes and the last step that was seen. Its saved case gives the same digits.
  const auto proposedBy = [this](std::vector<std::string> arguments, const std::string& key,
                                 nlohmann::ordered_json& step) {
    const auto saved = directory_.file(key);
    arguments.insert(arguments.begin(), "calibrate");
    arguments.insert(arguments.end(), {"--save", saved, "--accept", "--by", "somebody", "--json"});
    const auto run = box(arguments);
    EXPECT_EQ(run.status, 0) << run.err;
    nlohmann::ordered_json proposed;
    for (const auto& object : run.objects()) {
      if (object.contains("result")) proposed = object;
      const bool in_step = object.contains("kind") && (object["state"] == "waiting" || object["state"] == "running");
      if (in_step && object["steps"] > 0) step = object;
    }
    EXPECT_FALSE(proposed.is_null()) << run.out;
    const auto solved = probebox({"solve", "--json", saved});
    EXPECT_EQ(solved.status, 0) << solved.out << solved.err;
    EXPECT_TRUE(solved.object()["warnings"].empty()) << solved.out;
    for (const char* part : {"result", "sd"}) {
      const nlohmann::ordered_json value = solved.object()[part][key];
      EXPECT_EQ(value[0].is_array() ? value[0][0] : value[0], proposed[part][key + "[0]"]);
    }
    return proposed;
  };
  nlohmann::ordered_json step;
  const auto head = proposedBy({"sensor-head-calibration"}, "sensor_matrix", step);
  EXPECT_EQ(step["kind"], "hold");
  EXPECT_EQ(step["tool"], 5);
  const auto& world = *descriptions_.world;
  for (std::size_t i = 0; i < 9; ++i) {
    const auto component = "sensor_matrix[" + std::to_string(i) + "]";
    const double off = head["result"][component].get<double>() - world.further_tools.back().head->sensors[i / 3][i % 3];
    EXPECT_LT(std::abs(off), 5 * head["sd"][component].get<double>());
  }
  EXPECT_THAT(box({"history", "sensor-head-5"}).out, HasSubstr("active"));

  const auto axis = proposedBy({"rotary-axis-errors", "--head", "--angles", "4"}, "location_mm", step);
  EXPECT_EQ(step["kind"], "hold");
  EXPECT_EQ(step["steps"], 15) << "three balls at four stops, and once more where C began";
  const double x_mm = world.part_spindle.point_mm[0] - world.probe_spindle.stylus_offset_mm[0] -
                      descriptions_.machine.ball_plate->axis_point_mm[0];
  EXPECT_NEAR(axis["result"]["location_mm[0]"].get<double>(), x_mm, 5 * axis["sd"]["location_mm[0]"].get<double>());

  ASSERT_EQ(box({"rollback", "sensor-head-5", "--by", "somebody"}).status, 0);
  EXPECT_THAT(box({"calibrate", "rotary-axis-errors", "--head"}).err, HasSubstr("in force"));
}

// Positions at 50 Hz hold too little of a fast touch, which is told before the machine moves.
TEST_F(OnTheMachine, TellsBeforeARunThatItsPositionsComeTooSlowly) {
  start([](board::Descriptions& slow) { slow.box.devices.encoder_rate_hz = slow.world->encoders.rate_hz = 50; });
  const auto refused = box({"calibrate", "delay-known-sphere", "--speed", "40"});
  EXPECT_EQ(refused.status, 4);
  EXPECT_THAT(refused.err,
              testing::ContainsRegex("The encoder of X delivers (49\\.[0-9]|50(\\.[0-9])?) positions a second, "
                                     "and a touch at 40 mm/s needs 174: move at 11\\.[3-6] mm/s or less"));
  EXPECT_THAT(refused.out, testing::Not(HasSubstr("touch 1")));
  EXPECT_EQ(box({"calibrate", "delay-known-sphere", "--speed", "10"}).status, 0);
}

TEST_F(OnTheMachine, RefusesOptionsThatTheMethodCannotUse) {
  const auto slow = box({"calibrate", "delay-known-sphere", "--speed", "0.01"});
  EXPECT_EQ(slow.status, 4);
  EXPECT_THAT(slow.err, HasSubstr("0.5 to 100 mm/s"));
  EXPECT_THAT(box({"calibrate", "delay-plates", "--angles", "4"}).err, HasSubstr("rotary angles"));
  EXPECT_EQ(box({"calibrate", "centreline", "--angles", "-3"}).status, 2);
  EXPECT_THAT(box({"calibrate", "centre-line"}).err, HasSubstr("c-axis-alignment"));
}

}  // namespace
}  // namespace probebox::command
