#include "board/describe/parse.hpp"

#include <gmock/gmock.h>

#include "board/describe/sim_files.hpp"
#include "machine_with.hpp"
#include "problems.hpp"

namespace probebox::board {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr std::string_view kBox = R"([box]
board_name = "b1"
serial_number = "7"
[sync]
chip = "gpiochip0"
line = 4
active = "low"
period_ns = 1_000_000
[[trigger]]
chip = "gpiochip0"
line = "TOUCH"
[[index]]
axis = "Z"
chip = "gpiochip1"
line = 4
[devices]
encoders = "sim"
encoder_rate_hz = 1000
probe = "sim"
)";

// The box above with one text exchanged for another.
std::string exchangedInBox(std::string_view old_text, std::string_view new_text) {
  return exchanged(std::string{kBox}, old_text, new_text);
}

TEST(BoxToml, ShowsItselfOnUsbByTheNumbersOfItsVendor) {
  const auto usual = parseBox(kBox, "box.toml");
  ASSERT_TRUE(usual.ok());
  EXPECT_EQ(usual->usb.vendor_id, 0x1209);
  const auto box =
      parseBox(std::string{kBox} + "[usb]\nvendor_id = 0x2E8A\nproduct_id = 7\nproduct = \"P1\"\n", "box.toml");
  ASSERT_TRUE(box.ok()) << box.error().what;
  EXPECT_EQ(box->usb.vendor_id, 0x2E8A);
  EXPECT_EQ(box->usb.product_id, 7);
  EXPECT_EQ(box->usb.product, "P1");
}

TEST(BoxToml, RefusesWhatCannotGoOutOverUsb) {
  EXPECT_THAT(problemOfBox(std::string{kBox} + "[usb]\nvendor_id = 0x12345\n"), HasSubstr("vendor_id"));
  EXPECT_THAT(problemOfBox(std::string{kBox} + "[usb]\nproduct = \"two\\nlines\"\n"), HasSubstr("line break"));
  EXPECT_THAT(problemOfBox(exchangedInBox("serial_number = \"7\"", "serial_number = \"\u00fc7\"")), HasSubstr("ASCII"));
}

TEST(BoxToml, GivesLinesByRole) {
  const auto box = parseBox(kBox, "box.toml");
  ASSERT_TRUE(box.ok()) << box.error().what;
  EXPECT_EQ(box->sync.chip, "gpiochip0");
  EXPECT_EQ(std::get<unsigned>(box->sync.line), 4U);
  EXPECT_EQ(box->sync.active, ActiveLevel::low);
  EXPECT_EQ(box->sync_period, Nanoseconds{1'000'000});
  EXPECT_EQ(box->samples_per_tick, 1U);
  ASSERT_EQ(box->triggers.size(), 1U);
  EXPECT_EQ(box->triggers[0].name, "trigger 1");
  EXPECT_EQ(std::get<std::string>(box->triggers[0].line), "TOUCH");
  ASSERT_EQ(box->indexes.size(), 1U);
  EXPECT_EQ(box->indexes[0].axis, 2);
}

TEST(MachineToml, HasTheSdOfEverySize) {
  const auto machine = machineWith(
      "[datum_sphere]\ndiameter_mm = 25\nsd_diameter_mm = 0.0002\n[datum_plates.Y]\ngap_mm = 26\nsd_gap_mm = 0.0005\n"
      "[datum_cylinder]\ndiameter_mm = 30\nsd_diameter_mm = 0.0004\ntouched = \"inside\"\n"
      "[datum_cube]\nedges_mm = [20, 21, 22]\nsd_edge_mm = 0.0006\n"
      "[periodic_check]\nball_diameter_mm = 12\nsd_ball_diameter_mm = 0.0003\nball_centre_z_mm = -160\n");
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  EXPECT_EQ(machine->datum_sphere_sd_mm, 0.0002);
  EXPECT_FALSE(machine->datum_plates[0]);
  EXPECT_EQ(machine->datum_plates[1]->sd_gap_mm, 0.0005);
  EXPECT_EQ(machine->datum_cylinder->sd_diameter_mm, 0.0004);
  EXPECT_EQ(machine->datum_cylinder->touched, CylinderDescription::Touched::inside);
  EXPECT_EQ(machine->datum_cube->sd_edge_mm, 0.0006);
  EXPECT_EQ(machine->periodic_check->sd_ball_diameter_mm, 0.0003);
}

TEST(MachineToml, TakesPlatesWithoutAnAxisForThoseAcrossX) {
  const auto machine = machineWith("[datum_plates]\ngap_mm = 26\n[datum_plates.Z]\ngap_mm = 20\n");
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  EXPECT_EQ(machine->datum_plates[0]->gap_mm, 26);
  EXPECT_FALSE(machine->datum_plates[1]);
  EXPECT_EQ(machine->datum_plates[2]->gap_mm, 20);
  EXPECT_FALSE(machineWith("[datum_plates]\ngap_mm = 26\n[datum_plates.X]\ngap_mm = 26\n").ok());
}

// Only what is stated is believed: a missing key has its cautious value, and zero has to be written.
TEST(MachineToml, HasWhatIsKnownOfItsOwnErrors) {
  EXPECT_FALSE(machineWith("")->accuracy);
  const auto machine = machineWith("[accuracy]\nscale_ppm = 3\nlost_motion_um = 0\n");
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  EXPECT_EQ(machine->accuracy->scale_ppm, 3);
  EXPECT_EQ(machine->accuracy->lost_motion_um, 0);
  EXPECT_EQ(machine->accuracy->squareness_urad, MachineAccuracy{}.squareness_urad);
  EXPECT_GT(machine->accuracy->drift_um_per_min, 0);
  EXPECT_FALSE(machineWith("[accuracy]\nscale_ppm = -3\n").ok());
  const auto like_sim = parseMachine("like_sim = true\n[accuracy]\nscale_ppm = 3\n", "machine.toml");
  ASSERT_TRUE(like_sim.ok()) << like_sim.error().what;
  EXPECT_EQ(like_sim->name, "emulated three-axis mill");
  EXPECT_EQ(like_sim->accuracy->scale_ppm, 3);
  EXPECT_EQ(like_sim->accuracy->lost_motion_um, 0) << "as in board/sim";
}

TEST(BoxToml, NamesFileLineAndNearestKeyOfAnUnknownOne) {
  EXPECT_EQ(problemOfBox(exchangedInBox("serial_number", "serial_nummer")),
            "box.toml:3: unknown key 'box.serial_nummer': did you mean 'serial_number'?");
  EXPECT_EQ(problemOfBox(exchangedInBox("serial_number", "serial_number = \"7\"\ncolour")),
            "box.toml:4: unknown key 'box.colour': remove it");
}

TEST(BoxToml, RefusesADoubtfulUnit) {
  EXPECT_EQ(problemOfBox(exchangedInBox("period_ns", "period_us")),
            "box.toml:8: unknown key 'sync.period_us': the key says us, and this value is in ns: convert it and write "
            "'period_ns'");
  EXPECT_THAT(problemOfBox(exchangedInBox("period_ns", "period")), HasSubstr("no unit"));
}

TEST(BoxToml, RefusesAWrongType) {
  EXPECT_THAT(problemOfBox(exchangedInBox("1_000_000", "\"1 ms\"")),
              AllOf(HasSubstr("box.toml:8:"), HasSubstr("whole number")));
  EXPECT_THAT(problemOfBox(exchangedInBox("\"7\"", "7")), AllOf(HasSubstr("box.toml:3:"), HasSubstr("double quotes")));
  EXPECT_THAT(problemOfBox(exchangedInBox("[devices]", "[[devices]]")), HasSubstr("[devices]"));
  EXPECT_THAT(problemOfBox(exchangedInBox("line = 4", "line = 4.5")), HasSubstr("neither"));
}

TEST(BoxToml, TellsWhichKeyIsMissingAndWhere) {
  EXPECT_EQ(problemOfBox(exchangedInBox("board_name = \"b1\"\n", "")),
            "box.toml:1: missing key 'box.board_name': add it to [box]");
  EXPECT_THAT(
      problemOfBox(exchangedInBox("[devices]\nencoders = \"sim\"\nencoder_rate_hz = 1000\nprobe = \"sim\"\n", "")),
      testing::AllOf(HasSubstr("missing"), HasSubstr("'devices'")));
}

TEST(BoxToml, RefusesValuesOutOfRangeAndSaysTheRange) {
  EXPECT_THAT(problemOfBox(exchangedInBox("1_000_000", "1000")), HasSubstr("100000 to 10000000"));
  EXPECT_THAT(problemOfBox(exchangedInBox("line = 4", "line = -1")), HasSubstr("neither"));
  EXPECT_THAT(problemOfBox(exchangedInBox("\"Z\"", "\"Q\"")), HasSubstr("\"X\", \"Y\", \"Z\""));
}

TEST(BoxToml, RefusesTwoInputsOnOneLine) {
  EXPECT_THAT(problemOfBox(exchangedInBox("line = \"TOUCH\"", "line = 4")),
              testing::AllOf(HasSubstr("'trigger.line'"), HasSubstr("\"trigger 1\""), HasSubstr("\"sync\"")));
}

constexpr std::string_view kLoopBack = R"([loop_back]
output = { chip = "gpiochip0", line = 20 }
input = { chip = "gpiochip1", line = "BACK", active = "low" }
)";

TEST(BoxToml, MayHaveALineThatLoopsBack) {
  EXPECT_FALSE(parseBox(kBox, "box.toml")->loop_back);
  const auto box = parseBox(std::string{kBox}.append(kLoopBack), "box.toml");
  ASSERT_TRUE(box.ok()) << box.error().what;
  ASSERT_TRUE(box->loop_back);
  EXPECT_EQ(box->loop_back->output.name, "loop-back output");
  EXPECT_EQ(box->loop_back->output.chip, "gpiochip0");
  EXPECT_EQ(std::get<unsigned>(box->loop_back->output.line), 20U);
  EXPECT_EQ(box->loop_back->output.active, ActiveLevel::high);
  EXPECT_EQ(std::get<std::string>(box->loop_back->input.line), "BACK");
  EXPECT_EQ(box->loop_back->input.active, ActiveLevel::low);
}

TEST(BoxToml, RefusesALoopBackThatIsHalfThereOrOnALineInUse) {
  const auto with = [](std::string_view output, std::string_view input) {
    return std::string{kBox} + "[loop_back]\n" + std::string{output} + "\n" + std::string{input} + "\n";
  };
  constexpr std::string_view kOutput = "output = { chip = \"gpiochip0\", line = 20 }";
  EXPECT_THAT(problemOfBox(with(kOutput, "")), testing::AllOf(HasSubstr("missing"), HasSubstr("'loop_back.input'")));
  EXPECT_THAT(problemOfBox(with(kOutput, "input = { chip = \"gpiochip0\", line = 4 }")),
              AllOf(HasSubstr("box.toml:22:"), HasSubstr("\"loop-back input\""), HasSubstr("\"sync\"")));
  EXPECT_THAT(problemOfBox(with(kOutput, "input = { chip = \"gpiochip0\", line = 20 }")),
              testing::AllOf(HasSubstr("\"loop-back input\""), HasSubstr("\"loop-back output\"")));
  EXPECT_THAT(problemOfBox(with(kOutput, "input = { chip = \"gpiochip0\", line = 21, pull = \"up\" }")),
              testing::AllOf(HasSubstr("unknown"), HasSubstr("'loop_back.input.pull'")));
  EXPECT_THAT(problemOfBox(with("output = 20", "input = 21")), HasSubstr("a table"));
}

TEST(BoxToml, TellsAllProblemsInTheOrderOfTheFile) {
  auto text = exchangedInBox("serial_number", "serial");
  text.replace(text.find("1_000_000"), 9, "5");
  EXPECT_THAT(
      problemOfBox(text),
      ::testing::MatchesRegex("box.toml:3: [^\n]*serial_number[^\n]*\nbox.toml:8: [^\n]*out of its range[^\n]*"));
}

TEST(BoxToml, SaysWhereATextStopsBeingToml) {
  EXPECT_THAT(problemOfBox("[box\nboard_name = 1"), HasSubstr("box.toml:1:"));
  EXPECT_THAT(problemOfBox(std::string{"a = \xff\xfe\x00", 7}), HasSubstr("not TOML"));
  EXPECT_THAT(problemOfBox("[box]\nboard_name = \"a\"\nboard_name = \"b\"\n"), HasSubstr("box.toml:3:"));
}

TEST(MachineToml, RefusesASenseOfZeroAndAReversedTravel) {
  std::string text = "[machine]\nname = \"m\"\n[corrections]\nhold_s = 5\n";
  for (const auto* const axis : {"X", "Y", "Z"}) {
    text += std::string{"[axis."} + axis +
            "]\ncounts_per_mm = 1000\nsense = 0\ntravel_min_mm = 5\ntravel_max_mm = 5\n" +
            "correction_limit_mm = 4\ncorrection_rate_mm_s = 0.1\n";
  }
  const auto machine = parseMachine(text, "machine.toml");
  ASSERT_FALSE(machine.ok());
  EXPECT_THAT(machine.error().what, AllOf(HasSubstr("'axis.X.sense' = 0"), HasSubstr("exchange them"),
                                          HasSubstr("correction_limit_mm' = 4")));
}

constexpr std::string_view kRotaryC = "[rotary_axis.C]\nangle_from = \"encoder\"\ncounts_per_deg = 1000\nsense = -1\n";
constexpr std::string_view kRotaryB = "[rotary_axis.B]\nangle_from = \"controller\"\nstale_s = 2\n";

TEST(MachineToml, DescribesATableThatTurnsAndAHeadThatSwivels) {
  const auto machine = machineWith(std::string{kRotaryC} + std::string{kRotaryB} +
                                       "[swivel]\naxis = \"B\"\nby_angle = true\n"
                                       "[rotary_table]\nchain = [\"C\"]\ntool_point = \"tip\"\n"
                                       "tool_direction = [0, 0, -1]\nmeasured_length_mm = 100\nhold_s = 1\n"
                                       "[[tool]]\nnumber = 4\nlength_mm = 120.5\n",
                                   "sources = [\"swivel\", \"rotary\"]\n");
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  EXPECT_EQ(machine->corrections.mask, 0b0110);
  EXPECT_FALSE(machine->rotary_axes[0].has_value());
  EXPECT_EQ(machine->rotary_axes[1]->angle_from, AngleFrom::controller);
  EXPECT_EQ(machine->rotary_axes[1]->stale_s, 2);
  EXPECT_EQ(machine->rotary_axes[2]->sense, -1);
  EXPECT_EQ(machine->rotary_axes[2]->reference, ReferenceBy::homing);
  EXPECT_EQ(machine->swivel->axis, RotaryLetter::b);
  EXPECT_EQ(machine->swivel->hold_s, 5) << "that of [corrections]";
  EXPECT_THAT(machine->rotary_table->chain, ElementsAre(RotaryLetter::c));
  EXPECT_TRUE(machine->rotary_table->at_tip);
  EXPECT_EQ(machine->rotary_table->hold_s, 1);
  ASSERT_EQ(machine->tools.size(), 1U);
  EXPECT_EQ(machine->tools[0].length_mm, 120.5);
}

TEST(MachineToml, HasEachRotaryAxisInTheHeadOrInTheTable) {
  const std::string axes = std::string{kRotaryC} + std::string{kRotaryB};
  const std::string table = "[rotary_table]\nchain = [\"B\", \"C\"]\ntool_point = \"position\"\n";
  const auto machine = machineWith(axes + table);
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  EXPECT_THAT(machine->rotary_table->chain, ElementsAre(RotaryLetter::b, RotaryLetter::c));
  EXPECT_EQ(machineProblem(axes + table + "[swivel]\naxis = \"B\"\n"),
            "machine.toml:34: 'rotary_table.chain' names the axis B, and [swivel] has it as that of the head: an axis "
            "turns the table or the head, so remove it from one of them");
}

TEST(MachineToml, InterpolatesEachAxisOfATableInItsOwnWay) {
  const std::string axes = std::string{kRotaryC} + std::string{kRotaryB} +
                           "[rotary_table]\nchain = [\"B\", \"C\"]\ntool_point = \"position\"\nbetween = \"fourier\"\n";
  const auto tilts = [](std::string_view list) {
    return "[tilting_table]\naxis = \"X\"\ntilts_deg = " + std::string{list} + "\n";
  };
  const auto machine = machineWith(axes + "between_b = \"linear\"\n" + tilts("[-90, 0]"));
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  using enum BetweenAngles;
  EXPECT_THAT(machine->rotary_table->between_of, ElementsAre(fourier, linear, fourier));
  EXPECT_THAT(machineProblem(axes + tilts("[-90, 0]")),
              testing::AllOf(HasSubstr("'tilting_table.tilts_deg'"), HasSubstr("between_b")));
  EXPECT_TRUE(machineWith(axes + tilts("[-120, 0, 120]")).ok());
}

TEST(MachineToml, RefusesChainsAndHeadsThatCannotBe) {
  const auto table = [](std::string_view rest) {
    return machineProblem(std::string{kRotaryC} + "[rotary_table]\n" + std::string{rest});
  };
  EXPECT_THAT(machineProblem("[swivel]\naxis = \"B\"\n"), HasSubstr("add [rotary_axis.B]"));
  EXPECT_THAT(table("chain = [\"B\"]\ntool_point = \"position\"\n"), HasSubstr("add [rotary_axis.B]"));
  EXPECT_THAT(table("chain = [\"C\", \"C\"]\ntool_point = \"position\"\n"), HasSubstr("twice"));
  EXPECT_THAT(table("chain = [\"Z\"]\ntool_point = \"position\"\n"), HasSubstr("outwards"));
  EXPECT_THAT(table("chain = []\ntool_point = \"position\"\n"), HasSubstr("no axis"));
  EXPECT_THAT(table("chain = [\"C\"]\n"), testing::AllOf(HasSubstr("missing"), HasSubstr("'rotary_table.tool_point'")));
  EXPECT_THAT(table("chain = [\"C\"]\ntool_point = \"tip\"\ntool_direction = [0, 0, -0.5]\nmeasured_length_mm = 0\n"),
              HasSubstr("length 1"));
  EXPECT_THAT(table("chain = [\"C\"]\ntool_point = \"tip\"\ntool_direction = [0, 0, -1]\n"),
              HasSubstr("measured_length_mm"));
  EXPECT_THAT(machineProblem("[rotary_axis.B]\nangle_from = \"controller\"\n"), HasSubstr("rotary_axis.B.stale_s"));
  EXPECT_THAT(machineProblem("[rotary_axis.D]\nangle_from = \"controller\"\nstale_s = 1\n"), HasSubstr("unknown key"));
  EXPECT_THAT(machineProblem("[[tool]]\nnumber = 4\nlength_mm = 1\n[[tool]]\nnumber = 4\nlength_mm = 2\n"),
              HasSubstr("twice"));
}

TEST(MachineToml, MayDescribeTheBallOfThePeriodicCheck) {
  EXPECT_FALSE(machineWith("")->periodic_check);
  const std::string ball = "[periodic_check]\nball_diameter_mm = 12\nball_centre_z_mm = -160\n";
  const auto machine = machineWith(ball + "limit_mm = 0.02\n");
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  EXPECT_EQ(machine->periodic_check->ball_diameter_mm, 12);
  EXPECT_EQ(machine->periodic_check->limit_mm, 0.02);
  EXPECT_FALSE(machine->periodic_check->accepted_x_mm);
  EXPECT_THAT(machineProblem("[periodic_check]\nball_diameter_mm = 0\nlimits_mm = 1\n"),
              AllOf(HasSubstr("ball_centre_z_mm"), HasSubstr("range"), HasSubstr("limits_mm")));
}

TEST(MachineToml, MayDescribeThePlateOfTheRotaryAxis) {
  EXPECT_FALSE(machineWith("")->ball_plate);
  const std::string point = "[ball_plate]\naxis_point_mm = [330, 200, -300]\n";
  const std::string two = "[[ball_plate.ball]]\nat_mm = [30, 0, 140]\n[[ball_plate.ball]]\nat_mm = [-15, 26, 100]\n";
  const auto machine = machineWith(point + "sd_mm = 0.0005\n" + two + "[[ball_plate.ball]]\nat_mm = [-15, -26, 60]\n");
  ASSERT_TRUE(machine.ok()) << machine.error().what;
  const auto& plate = *machine->ball_plate;
  EXPECT_FALSE(plate.station_correction);
  EXPECT_FALSE(plate.b_axis_point_mm);
  const auto on_b = machineWith(point + "b_axis_point_mm = [1, 2, 3]\nstation_correction = true\n" + two +
                                "[[ball_plate.ball]]\nat_mm = [-15, -26, 60]\n");
  ASSERT_TRUE(on_b.ok()) << on_b.error().what;
  EXPECT_TRUE(on_b->ball_plate->station_correction);
  EXPECT_EQ(on_b->ball_plate->b_axis_point_mm.value()[2], 3);
  EXPECT_EQ(plate.axis_point_mm, (std::array<double, 3>{330, 200, -300}));
  EXPECT_EQ(plate.sd_mm, 0.0005);
  ASSERT_EQ(plate.balls_mm.size(), 3U);
  EXPECT_EQ(plate.balls_mm[1], (std::array<double, 3>{-15, 26, 100}));
  EXPECT_THAT(machineProblem(point + two), HasSubstr("2 times"));
  EXPECT_THAT(machineProblem(point), testing::AllOf(HasSubstr("missing"), HasSubstr("'ball_plate.ball'")));
  EXPECT_THAT(machineProblem("[ball_plate]\nsd_mm = 5\n" + two), AllOf(HasSubstr("axis_point_mm"), HasSubstr("range")));
}

TEST(ProbeToml, RefusesAGainWithoutAnInverse) {
  const std::string text =
      "[probe]\nserial_number = \"1\"\nrate_hz = 1000\nnoise_um = 0.4\ndeflection_limit_mm = 1\n"
      "gain = [[1, 0, 0], [0, 1, 0], [1, 1, 0]]\n[stylus]\nball_diameter_mm = 6\n";
  const auto probe = parseProbe(text, "probe.toml");
  ASSERT_FALSE(probe.ok());
  EXPECT_THAT(probe.error().what, AllOf(HasSubstr("probe.toml:6:"), HasSubstr("inverse")));
  EXPECT_THAT(parseProbe("[probe]\ngain = [[1, 0], [0, 1]]\n[stylus]\n", "p").error().what, HasSubstr("three rows"));
  EXPECT_THAT(parseProbe("[probe]\nnoise_um = nan\n[stylus]\n", "p").error().what, HasSubstr("range"));
}

// Runs refuse an overtravel below 0.3 mm with a switch, so such a limit would allow none.
TEST(ProbeToml, RefusesALimitThatNoTouchWithASwitchKeeps) {
  const auto limited = [](const std::string& limit_mm) {
    return parseProbe(
        "[probe]\nserial_number = \"1\"\nkind = \"trigger\"\ntrigger = \"touch\"\nrepeatability_um = 0.25\n"
        "deflection_limit_mm = " +
            limit_mm + "\n[stylus]\nball_diameter_mm = 6\n",
        "probe.toml");
  };
  const auto probe = limited("0.29");
  ASSERT_FALSE(probe.ok());
  EXPECT_THAT(probe.error().what, AllOf(HasSubstr("probe.toml:6:"), HasSubstr("below 0.3"), HasSubstr("0.3 or")));
  EXPECT_TRUE(limited("0.3").ok());
}

TEST(ServiceToml, AllowsNothingThatItDoesNotName) {
  const auto service = parseService("", "service.toml");
  ASSERT_TRUE(service.ok());
  EXPECT_EQ(service->access, Access{});
  EXPECT_TRUE(service->links.empty());
}

TEST(ServiceToml, LetsUsbProvisionUnlessItSaysOtherwise) {
  const auto on_usb = [](const std::string& text) {
    const auto service = parseService("links = [\"usb\"]\ncnc = []\n" + text, "service.toml");
    EXPECT_TRUE(service.ok()) << service.error().what;
    return onUsb(service->accessAt("usb")).allow_provision;
  };
  EXPECT_EQ(on_usb(""), true);
  EXPECT_EQ(on_usb("[access]\nallow_accept = true\n"), true);
  EXPECT_EQ(on_usb("[access]\nallow_provision = false\n"), false);
  EXPECT_EQ(on_usb("[[connection]]\naddress = \"usb\"\nallow_provision = false\n"), false);
  EXPECT_EQ(on_usb("[[connection]]\naddress = \"usb\"\nread_only = true\n"), false);
  EXPECT_EQ(on_usb("[[connection]]\naddress = \"usb\"\nread_only = true\nallow_provision = false\n"), false);
  EXPECT_FALSE(parseService("links = []\ncnc = []\n", "service.toml")->access.allow_provision);
}

TEST(ServiceToml, GivesAConnectionRightsOfItsOwnInPlaceOfTheOthers) {
  const auto service = parseService(
      "links = [\"usb\", \"tcp:0.0.0.0:7627\"]\ncnc = [\"modbus:/dev/ttyS2\"]\n"
      "[access]\nallow_accept = true\nallow_update = true\n"
      "[[connection]]\naddress = \"modbus:/dev/ttyS2\"\nallow_marker = true\nallow_inhibit = true\n"
      "[[connection]]\naddress = \"tcp:0.0.0.0:7627\"\nread_only = true\n",
      "service.toml");
  ASSERT_TRUE(service.ok()) << service.error().what;
  EXPECT_EQ(service->accessAt("usb"), (Access{.allow_accept = true, .allow_update = true}));
  EXPECT_EQ(service->accessAt("modbus:/dev/ttyS2"), (Access{.allow_marker = true, .allow_inhibit = true}));
  EXPECT_EQ(service->accessAt("tcp:0.0.0.0:7627"), Access{.allow_provision = false});
  EXPECT_TRUE(service->connectionAt("tcp:0.0.0.0:7627")->read_only);
  EXPECT_FALSE(givesARight(service->connectionAt("tcp:0.0.0.0:7627")->access));
  EXPECT_EQ(service->connectionAt("usb"), nullptr);
}

TEST(ServiceToml, RefusesAConnectionThatLeadsNowhereOrContradictsItself) {
  const std::string links = "links = [\"usb\"]\n";
  const auto problem = [&](const std::string& connection) {
    const auto service = parseService(links + "[[connection]]\n" + connection, "s");
    return service.ok() ? "accepted" : service.error().what;
  };
  EXPECT_THAT(problem("address = \"usb:other\"\n"), HasSubstr("'connection.address'"));
  EXPECT_THAT(problem("allow_accept = true\n"), HasSubstr("address"));
  EXPECT_THAT(problem("address = \"usb\"\nread_only = true\nallow_marker = true\n"), HasSubstr("contradicts"));
  EXPECT_THAT(problem("address = \"usb\"\nread_only = true\nallow_provision = true\n"), HasSubstr("contradicts"));
  EXPECT_THAT(problem("address = \"usb\"\n[[connection]]\naddress = \"usb\"\n"), HasSubstr("[[connection]]"));
  EXPECT_THAT(problem("address = \"usb\"\nallow_homming = true\n"), HasSubstr("allow_homing"));
}

constexpr const char* kTls =
    "links = [\"tls:0.0.0.0:7628\"]\n[tls]\ncertificate = \"/c\"\nkey = \"/k\"\npeople_ca = \"/p\"\n";

TEST(ServiceToml, GivesRightsToPersonsWhoComeByTls) {
  const std::string digits(62, '0');
  const auto service = parseService(std::string{kTls} + "shut_out = [\"AB:" + digits + "\", \"cd" + digits + "\"]\n" +
                                        "[access]\nallow_update = true\n"
                                        "[[person]]\nname = \"Ada\"\nallow_calibrate = true\nallow_accept = true\n"
                                        "[[person]]\nname = \"Bob\"\n",
                                    "service.toml");
  ASSERT_TRUE(service.ok()) << service.error().what;
  EXPECT_EQ(service->accessOf("Ada"), (Access{.allow_calibrate = true, .allow_accept = true}));
  for (const auto* who : {"Bob", "ada", "Eve", ""}) EXPECT_FALSE(givesARight(service->accessOf(who))) << who;
  ASSERT_TRUE(service->tls);
  EXPECT_THAT(service->tls->shut_out, testing::ElementsAre("ab" + digits, "cd" + digits));
}

TEST(ServiceToml, RefusesADoorWithoutKeysAndPersonsWithoutADoor) {
  const auto problem = [](const std::string& text) {
    const auto service = parseService(text, "s");
    return service.ok() ? "accepted" : service.error().what;
  };
  EXPECT_EQ(problem(kTls), "accepted");
  EXPECT_EQ(problem("links = [\"tls:0.0.0.0:7628\"]\n[tls]\n"), "accepted") << "with provisioned keys";
  EXPECT_THAT(problem("links = [\"tls:0.0.0.0:7628\"]\n"), HasSubstr("'tls'"));
  EXPECT_THAT(problem("links = [\"tls:0.0.0.0:7628\"]\n[tls]\nkey = \"box.key\"\n"),
              testing::AllOf(HasSubstr("certificate"), HasSubstr("people_ca"), HasSubstr("full path")));
  EXPECT_THAT(problem("[[person]]\nname = \"Ada\"\n"), HasSubstr("[tls]"));
  EXPECT_THAT(problem(kTls + std::string{"shut_out = [\"Ada\"]\n"}), HasSubstr("'tls.shut_out'"));
  EXPECT_THAT(problem(kTls + std::string{"[[person]]\nname = \"Ada\"\n[[person]]\nname = \"Ada\"\n"}),
              HasSubstr("already"));
  EXPECT_THAT(problem(kTls + std::string{"[[person]]\nallow_accept = true\n"}), HasSubstr("name"));
  EXPECT_THAT(problem(kTls + std::string{"[[connection]]\naddress = \"tls:0.0.0.0:7628\"\nallow_accept = true\n"}),
              HasSubstr("[[person]]"));
}

TEST(ServiceToml, RefusesWhatIsNoAddress) {
  EXPECT_THAT(parseService("links = [\"usb\", \"localhost\"]", "s").error().what,
              testing::AllOf(HasSubstr("s:1"), HasSubstr("'links'"), HasSubstr("\"localhost\"")));
  EXPECT_FALSE(parseService("cnc = [\"modbus:\"]", "s").ok());
  EXPECT_FALSE(parseService("links = \"tcp:127.0.0.1:1\"", "s").ok());
  EXPECT_THAT(parseService("[access]\nallow_accept = \"yes\"", "s").error().what, HasSubstr("without quotes"));
}

TEST(WorldToml, RefusesMillisecondsWrittenAsSeconds) {
  EXPECT_THAT(parseWorld("[delays]\ntau_machine_s = [5.45, 5.45, 5.45]\ntau_probe_s = 0.0", "world.toml").error().what,
              HasSubstr("'delays.tau_machine_s' = 5.45"));
}

TEST(WorldToml, HasNoFeaturesThatItDoesNotDescribe) {
  const std::string world{simFile("world.toml")};
  const auto begin = world.find("# Gaps of known width"), end = world.find("# Five touches");
  ASSERT_LT(begin, end);
  const auto bare = parseWorld(world.substr(0, begin) + world.substr(end), "world.toml");
  ASSERT_TRUE(bare.ok()) << bare.error().what;
  EXPECT_FALSE(bare->plates[0] || bare->cylinder || bare->cube || bare->tilting_table || bare->swivel_head);
  EXPECT_TRUE(bare->part_spindle.balls_mm.empty() && bare->further_tools.empty());
  EXPECT_FALSE(bare->probe_spindle.shank);
}

TEST(WorldToml, RefusesAHalfDescribedSpindle) {
  EXPECT_THAT(
      parseWorld("[part_spindle]\ntilt_x_rad = 5\n[[part_spindle.ball]]\nat_m = [0, 0, 0]\n", "w").error().what,
      AllOf(HasSubstr("'part_spindle.tilt_x_rad' = 5"), HasSubstr("part_spindle.point_mm"), HasSubstr("at_mm")));
}

}  // namespace
}  // namespace probebox::board
