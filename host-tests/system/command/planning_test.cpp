// For which machine `probebox plan` forecasts, and what it says of its uncertainty.
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "board/describe/sim_files.hpp"
#include "board/describe/start_files.hpp"
#include "fake_box.hpp"
#include "in_process.hpp"
#include "protocol/messages/control.hpp"
#include "runtime_directory.hpp"

namespace probebox::command {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::HasSubstr;
using testing::Not;

using Said = messages::DescribeMachine::Answer;

// A lathe with one tool to measure, a ball plate and nothing that tilts or swivels.
Said latheOfTest() {
  Said says{.machine = "lathe of a test", .mounting = "turret"};
  says.probe = {.name = "P-17", .noise_um = 1.5, .ball_diameter_mm = 4, .sd_ball_diameter_mm = 0.0002};
  says.positions_hz = {4000, 4000, 500};
  says.deflections_hz = 1000;
  says.delay = {.calibrated = true, .tau_s = {}, .sd_s = {1e-6, 1e-6, 1e-6}, .result_id = 3};
  says.sphere = {.diameter_mm = 20, .sd_diameter_mm = 0.0004};
  says.sigma_c_rad = 2e-4;
  says.plate = {
      {.axis_point_mm = {0, 0, 0}, .sd_mm = 0.0005, .balls_mm = {{100, 0, 0}, {-50, 87, 40}, {-50, -87, 80}}}};
  says.accuracy = {messages::AccuracyInUse{{0, 0, 0, 0}}};
  says.carriers = {{.number = 3, .length_mm = 150, .result_id = 0}};
  says.tools = {{.number = 7, .length_mm = 90, .sd_mm = 0.001}};
  says.setter = {{.half_width_mm = {5, 5, 5}, .sd_probe_offset_mm = 0.002, .accepted = true, .limit_mm = 0.1}};
  return says;
}

FakeBoxOptions describing(const Said& says) {
  FakeBoxOptions options;
  options.answers_first = [says](messages::Operation operation, std::span<const std::byte>) {
    return operation == messages::Operation::describe_machine
               ? std::optional{FakeReply{.code = messages::ErrorCode::ok, .text = {}, .body = messages::encoded(says)}}
               : std::nullopt;
  };
  return options;
}

Finished planOf(const FakeBox& box, std::vector<std::string> words) {
  words.insert(words.begin(), {"-u", box.uri(), "plan"});
  return probebox(words);
}

TEST(Planning, WithoutABoxSaysThatItsMachineIsUsualAndWhatIsNotInU) {
  const auto done = probebox({"plan", "delay-known-sphere"});
  EXPECT_THAT(done.out, AllOf(HasSubstr("k = 1"), HasSubstr("not in u, taken as exact: certificate"),
                              HasSubstr("sd_effective_diameter_mm"), HasSubstr("sd_stylus_ball_diameter_mm"),
                              HasSubstr("usual machine"), HasSubstr("1000 positions"), HasSubstr("0.5 um")));
  const auto machine = probebox({"plan", "delay-known-sphere", "--json"}).object()["machine"];
  EXPECT_EQ(machine["name"], nullptr);
  EXPECT_EQ(machine["box"], nullptr);
}

TEST(Planning, AsksTheBoxThatIsNamed) {
  const FakeBox box{describing(latheOfTest())};
  const auto page = planOf(box, {"delay-known-sphere"});
  EXPECT_EQ(page.status, 0) << page.err;
  EXPECT_THAT(page.out, AllOf(Not(HasSubstr("not in u")),
                              HasSubstr("for lathe of a test with P-17, as the box " + box.uri() + " says"),
                              HasSubstr("of the box: 500 positions"), HasSubstr("1000 deflections"),
                              HasSubstr("1.5 um"), HasSubstr("0.5 um"), HasSubstr("10000 mm/s2")));
  const auto machine = planOf(box, {"delay-known-sphere", "--json"}).object()["machine"];
  EXPECT_EQ(machine["positions_hz"], 500) << "of the slowest axis";
  EXPECT_EQ(machine["deflections_hz"], 1000);
  EXPECT_EQ(machine["deflections_noise_um"], 1.5);
  EXPECT_EQ(machine["why_refused"], nullptr);
  // C stops 40 times as far off as usual, and what it turns is nearly twice as far from it.
  const auto of_lathe = planOf(box, {"c-axis-alignment", "--json"});
  const auto offsetSd = [](const Finished& done) {
    return done.object()["sd"]["offset_C_minus_A_mm[1]"].get<double>();
  };
  EXPECT_GT(offsetSd(planOf(box, {"spindle-offset-2x2", "--json"})),
            5 * offsetSd(probebox({"plan", "spindle-offset-2x2", "--json"})));
  EXPECT_THAT(of_lathe.object()["in_u"], testing::IsEmpty()) << "it has no table and no head that could be off";
}

TEST(Planning, SaysWhyTheBoxWouldRefuseTheRun) {
  auto says = latheOfTest();
  const FakeBox box{describing(says)};
  EXPECT_THAT(planOf(box, {"sensor-head-calibration"}).out, HasSubstr("refused: sensor-head-calibration"));
  const auto one_length = planOf(box, {"swivel-error"});
  EXPECT_EQ(one_length.status, 1);
  EXPECT_THAT(one_length.err, HasSubstr("swivel-error needs "));
  EXPECT_THAT(planOf(box, {"screw-calibration", "--axis", "X"}).out, HasSubstr("refused:"));
  const auto no_tool = planOf(box, {"tool-setter", "--tool", "4"});
  EXPECT_EQ(no_tool.status, 1);
  EXPECT_THAT(no_tool.err, HasSubstr("of 7"));
  EXPECT_THAT(planOf(box, {"periodic-check"}).out, HasSubstr("refused: periodic-check"));
  says.checked_ball = {{.ball_diameter_mm = 12, .swivels_rad = {0.8}}};
  says.delay = {};
  const FakeBox new_box{describing(says)};
  EXPECT_THAT(planOf(new_box, {"tool-setter", "--tool", "4"}).err, HasSubstr("of 7"));
  EXPECT_THAT(planOf(new_box, {"periodic-check"}).out, HasSubstr("at 0"));
  EXPECT_THAT(planOf(new_box, {"centreline"}).out, HasSubstr("refused: centreline"));
}

TEST(Planning, OptionsReplaceWhatTheBoxSays) {
  const FakeBox box{describing(latheOfTest())};
  const auto machine = planOf(box, {"delay-known-sphere", "--json", "--probe-noise", "0.1", "--machine-rate", "3000"})
                           .object()["machine"];
  EXPECT_EQ(machine["deflections_noise_um"], 0.1);
  EXPECT_EQ(machine["positions_hz"], 3000);
  EXPECT_EQ(machine["deflections_hz"], 1000);
}

TEST(Planning, OfAFileHasItsMachineAndTheProbeOfTheBox) {
  const FakeBox box{describing(latheOfTest())};
  const RuntimeDirectory directory;
  const auto path = directory.file("machine.toml");
  std::ofstream{path} << board::simFile("machine.toml");
  const auto both = planOf(box, {"delay-known-sphere", "--machine", path});
  EXPECT_THAT(both.out, AllOf(HasSubstr("for emulated three-axis mill, as " + path +
                                        " says in the place of lathe of a "
                                        "test of the box " +
                                        box.uri() + "; with its P-17, rates and delay"),
                              Not(HasSubstr("with the datum sphere of"))))
      << "the certificate is of another sphere";
  const auto alone = probebox({"plan", "delay-known-sphere", "--machine", path});
  EXPECT_THAT(alone.out, HasSubstr("for emulated three-axis mill, as " + path + " says; no box was asked"));
  EXPECT_THAT(alone.out, HasSubstr("6 mm"));
}

TEST(Planning, OfFilesHasTheSphereAndTheProbe) {
  const RuntimeDirectory directory;
  const auto machine = directory.file("machine.toml"), unit = directory.file("unit.toml"),
             probe = directory.file("probe.toml");
  std::ofstream{machine} << board::simFile("machine.toml");
  const auto written = [](const std::string& path, std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    std::ofstream{path} << text;
  };
  written(unit, std::string{board::startFile("unit.toml")}, "25.00018", "25.0001");
  written(probe, std::string{board::simFile("probe.toml")}, "# sd_ball_diameter_mm", "sd_ball_diameter_mm");
  const auto plan = [](std::vector<std::string> words) {
    words.insert(words.begin(), {"plan", "delay-known-sphere"});
    return probebox(words);
  };
  const auto of_all = plan({"--machine", machine, "--unit", unit, "--probe", probe});
  EXPECT_EQ(of_all.status, 0) << of_all.err;
  EXPECT_THAT(of_all.out, AllOf(Not(HasSubstr("not in u")), HasSubstr("with the datum sphere of " + unit),
                                HasSubstr("with the probe SIM-PROBE-1, as " + probe + " says"), HasSubstr("2000"),
                                Not(HasSubstr("of the box: "))));
  const auto described = plan({"--machine", machine, "--unit", unit, "--probe", probe, "--json"}).object()["machine"];
  EXPECT_EQ(described["unit_file"], unit);
  EXPECT_EQ(described["probe"], "SIM-PROBE-1");
  // Of another sphere, of nothing, without its machine.
  written(unit, std::string{board::startFile("unit.toml")}, "25.00018", "20.00018");
  EXPECT_THAT(plan({"--machine", machine, "--unit", unit}).out, HasSubstr("certified sphere"));
  EXPECT_THAT(plan({"--machine", machine, "--unit", directory.file("none")}).err, HasSubstr("unit.toml"));
  EXPECT_THAT(plan({"--probe", machine}).err, HasSubstr("machine.toml:"));
  EXPECT_EQ(plan({"--unit", unit}).status, 2);

  const FakeBox box{describing(latheOfTest())};
  EXPECT_THAT(planOf(box, {"delay-known-sphere", "--probe", probe}).out,
              AllOf(HasSubstr("lathe of"), HasSubstr("SIM-PROBE-1"), HasSubstr("0.4 um")));
}

// A table that stops 2e-4 rad off moves the axis by that times the height of the point above the table's own axis.
TEST(Planning, OfTheErrorsOfAnAxisIsAboutThePointOfTheRun) {
  const auto spreadOfY = [](double table_z_mm) {
    auto says = latheOfTest();
    says.sigma_c_rad = 1e-7;
    says.table = {{.axis = {1, 0, 0}, .sigma_rad = 2e-4, .has_point = true, .point_mm = {0, 0, table_z_mm}}};
    const FakeBox box{describing(says)};
    const auto done = planOf(box, {"rotary-axis-errors", "--angles", "3", "--json"});
    EXPECT_EQ(done.status, 0) << done.err;
    return done.object()["u"]["deviation_YC_at_120_deg_mm"].get<double>();
  };
  const double near_mm = spreadOfY(0), far_mm = spreadOfY(40);
  // What the axis does at 120 degrees counts from zero: 1 - cos(120 deg) of the arm.
  constexpr double kMoved_mm = 1.5 * 2e-4 * 40;
  EXPECT_NEAR(std::sqrt(far_mm * far_mm - near_mm * near_mm), kMoved_mm, 0.05 * kMoved_mm);
  EXPECT_LT(near_mm, 2e-4 * 10) << "whose axis goes through the point";
}

TEST(Planning, HasTheLargestOvertravelOfTheBoxsProbe) {
  auto says = latheOfTest();
  const std::vector<std::string> deep{"delay-known-sphere", "--overtravel", "5"};
  EXPECT_EQ(planOf(FakeBox{describing(says)}, deep).status, 0) << "an older box states no limit";
  says.probe.deflection_limit_mm = 1;
  const auto done = planOf(FakeBox{describing(says)}, deep);
  EXPECT_EQ(done.status, 1);
  EXPECT_THAT(done.err, AllOf(HasSubstr("5 mm"), HasSubstr("0.05 to"), HasSubstr("1 mm")));
  const RuntimeDirectory directory;
  const auto probe = directory.file("probe.toml");
  std::ofstream{probe} << board::simFile("probe.toml");
  says.probe.deflection_limit_mm = 10;
  EXPECT_THAT(planOf(FakeBox{describing(says)}, {"delay-known-sphere", "--overtravel", "5", "--probe", probe}).err,
              AllOf(HasSubstr("0.05 to"), HasSubstr("1 mm")));
}

TEST(Planning, RefusesAsTheBoxDoesWhatItsSourcesAreTooSlowFor) {
  const FakeBox box{describing(latheOfTest())};
  const auto fast = planOf(box, {"delay-known-sphere", "--speed", "100", "--overtravel", "0.05"});
  EXPECT_EQ(fast.status, 1);
  EXPECT_THAT(fast.err, AllOf(HasSubstr("of X"), HasSubstr("4000"), HasSubstr("100 mm/s")));
  EXPECT_THAT(planOf(box, {"delay-known-sphere", "--speed", "40", "--overtravel", "0.05"}).err,
              AllOf(HasSubstr("of Z"), HasSubstr("500")));
}

TEST(Planning, NamesTheOptionThatNoRunIsPossibleWith) {
  const auto whyNot = [](const char* option, const char* value) {
    const auto done = probebox({"plan", "delay-multi-speed", option, value});
    EXPECT_EQ(done.status, 1) << option;
    EXPECT_THAT(done.err, Not(HasSubstr("again"))) << option;
    return done.err;
  };
  EXPECT_THAT(whyNot("--probe-rate", "0.5"), AllOf(HasSubstr("0.5"), HasSubstr("--probe-rate 0.5")));
  EXPECT_THAT(whyNot("--machine-rate", "20"), HasSubstr("--machine-rate 20"));
  EXPECT_THAT(whyNot("--acceleration", "1"), AllOf(HasSubstr("12.5 mm"), HasSubstr("5 mm/s")));
  EXPECT_THAT(whyNot("--probe-noise", "1000"), HasSubstr("--probe-noise 1000"));
}

TEST(Planning, IsOfMachinesThatThereAre) {
  for (const std::string option :
       {"--machine-rate", "--machine-noise", "--probe-rate", "--probe-noise", "--switch-noise", "--acceleration"}) {
    for (const std::string value : {"1e-300", "1e300"}) {
      const auto done = probebox({"plan", "delay-multi-speed", option, value});
      EXPECT_EQ(done.status, 2) << option;
      EXPECT_THAT(done.err, AllOf(HasSubstr(option), HasSubstr(value + " is not a number from"))) << option;
    }
  }
}

TEST(Planning, SaysWhichFileCannotBeRead) {
  const RuntimeDirectory directory;
  const auto machine = directory.file("machine.toml"), folder = directory.path().string();
  std::ofstream{machine} << board::simFile("machine.toml");
  for (const auto& words : std::vector<std::vector<std::string>>{
           {"--machine", folder}, {"--probe", folder}, {"--machine", machine, "--unit", folder}}) {
    std::vector<std::string> all{"plan", "delay-known-sphere"};
    all.insert(all.end(), words.begin(), words.end());
    const auto done = probebox(all);
    EXPECT_EQ(done.status, 2);
    EXPECT_THAT(done.err, HasSubstr(folder + " cannot be read (it is a folder): give the "));
  }
}

TEST(Planning, EndsAtCtrlC) {
  const std::atomic<bool> interrupted{true};
  for (const auto& more : std::vector<std::vector<std::string>>{{}, {"--time", "300"}}) {
    std::vector<std::string> words{"plan", "delay-multi-speed"};
    words.insert(words.end(), more.begin(), more.end());
    const auto done = probebox(words, {}, &interrupted);
    EXPECT_EQ(done.status, 130);
    EXPECT_EQ(done.out, "");
  }
}

TEST(Planning, PrintsRatesWithoutPowersOfTen) {
  auto says = latheOfTest();
  says.positions_hz = {19999.98, 20000, 20000};
  EXPECT_THAT(planOf(FakeBox{describing(says)}, {"delay-known-sphere"}).out, HasSubstr("20000"));
}

// It was passed over in silence.
TEST(Planning, FailsWhereTheNamedBoxDoesNotAnswer) {
  const auto nobody = probebox({"-u", "tcp:127.0.0.1:1", "plan", "centreline"});
  EXPECT_EQ(nobody.status, 3);
  EXPECT_EQ(nobody.out, "");
  const FakeBox old;
  const auto before = planOf(old, {"centreline"});
  EXPECT_EQ(before.status, 4);
  EXPECT_THAT(before.err, HasSubstr("--machine FILE"));
}

TEST(Planning, AsksTheBoxOfTheEnvironment) {
  const FakeBox box{describing(latheOfTest())};
  ASSERT_EQ(setenv("PROBEBOX_URI", box.uri().c_str(), 1), 0);
  const auto asked = probebox({"plan", "delay-known-sphere", "--json"});
  ASSERT_EQ(setenv("PROBEBOX_URI", "file:recording.pbx", 1), 0);
  const auto recording = probebox({"plan", "delay-known-sphere", "--json"});
  unsetenv("PROBEBOX_URI");
  EXPECT_EQ(asked.object()["machine"]["name"], "lathe of a test");
  EXPECT_EQ(recording.object()["machine"]["name"], nullptr) << "a recording has no machine";
}

}  // namespace
}  // namespace probebox::command
