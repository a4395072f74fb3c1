#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <string>
#include <sys/stat.h>

#include "board/describe/file_content.hpp"
#include "board/describe/parse.hpp"
#include "board/describe/sim_files.hpp"
#include "host-tests/support/temporary_folder.hpp"

// The files of a board, read together.
namespace probebox::board {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

// A real axis leans a little over the nominal one.
void expectAlong(const Vector3& direction, const Vector3& axis) {
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(direction.at(i), axis.at(i), 0.01);
}

TEST(SimBoard, IsCompiledInAndDescribesWhatItEmulates) {
  const auto sim = simDescriptions();
  ASSERT_TRUE(sim.ok()) << sim.error().what;
  ASSERT_TRUE(sim->world.has_value());
  EXPECT_EQ(sim->box.sync_period.count(), sim->world->clock.period_ns);
  EXPECT_DOUBLE_EQ(sim->probe.rate_hz, sim->world->probe.rate_hz);
  EXPECT_DOUBLE_EQ(sim->box.devices.encoder_rate_hz, sim->world->encoders.rate_hz);
  EXPECT_DOUBLE_EQ(sim->probe.ball_diameter_mm, 2 * sim->world->sphere.stylus_ball_radius_mm);
  EXPECT_DOUBLE_EQ(sim->machine.datum_sphere_diameter_mm.value(), 2 * sim->world->sphere.radius_mm);
  for (std::size_t axis = 0; axis < 3; ++axis)
    EXPECT_DOUBLE_EQ(sim->machine.datum_plates.at(axis).value().gap_mm, sim->world->plates.at(axis).value().gap_mm);
  EXPECT_DOUBLE_EQ(sim->machine.datum_cylinder.value().diameter_mm, sim->world->cylinder.value().diameter_mm);
  EXPECT_EQ(sim->machine.datum_cylinder->touched == CylinderDescription::Touched::inside,
            sim->world->cylinder->isBore());
  EXPECT_EQ(sim->machine.datum_cube.value().edges_mm, sim->world->cube.value().edges_mm);
  EXPECT_DOUBLE_EQ(sim->machine.sigma_c_rad, sim->world->rotary.noise_rad);
  EXPECT_EQ(sim->world->part_spindle.balls_mm.size(), 3U);
  const auto& head = sim->machine.swivel_head.value();
  expectAlong(sim->world->swivel_head.value().direction, head.swivel.axis);
  EXPECT_DOUBLE_EQ(head.swivel.sigma_rad, sim->world->swivel_head->noise_rad);
  EXPECT_EQ(head.ball_mm.value(), sim->world->sphere.centre_mm)
      << "positions are those of the first tool's stylus ball";
  const auto& spindle = sim->world->probe_spindle;
  ASSERT_EQ(sim->machine.probe_tools.size(), 2U);
  EXPECT_EQ(sim->machine.probe_tools[0].number, spindle.tool);
  EXPECT_EQ(sim->machine.probe_tools[0].length_mm, spindle.stylus_length_mm);
  EXPECT_EQ(sim->machine.probe_tools[1].number, sim->world->further_tools.at(0).number);
  EXPECT_EQ(sim->machine.probe_tools[1].length_mm, sim->world->further_tools.at(0).length_mm);
  expectAlong(sim->world->tilting_table.value().direction, sim->machine.tilting_table.value().axis);
  EXPECT_DOUBLE_EQ(sim->machine.tilting_table->sigma_rad, sim->world->rotary.noise_rad);
  EXPECT_DOUBLE_EQ(sim->machine.rotary_axes[2].value().counts_per_deg, sim->world->rotary.c_counts_per_deg);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto& description = sim->machine.axes[axis];
    EXPECT_DOUBLE_EQ(description.counts_per_mm, sim->world->encoders.counts_per_mm);
  }
}

class BoardFolder : public ::testing::Test {
 protected:
  BoardFolder() {
    std::filesystem::create_directories(folder_ / "board");
    std::filesystem::create_directories(folder_ / "config");
  }

  static void write(const std::filesystem::path& path, std::string_view text) { std::ofstream{path} << text; }

  const support::TemporaryFolder temporary_;
  const std::filesystem::path& folder_ = temporary_.path();
};

TEST_F(BoardFolder, IsReadWithTheFilesOfConfigInstead) {
  write(folder_ / "config" / "service.toml", "links = [\"tcp:127.0.0.1:9\"]\n");
  const auto sim = simDescriptions(folder_ / "config");
  ASSERT_TRUE(sim.ok()) << sim.error().what;
  EXPECT_THAT(sim->service.links, ElementsAre("tcp:127.0.0.1:9"));
  EXPECT_FALSE(sim->service.access.allow_accept) << "the file stands for itself, it is not merged";
}

// The emulated machine parks at its home, high over all features.
TEST_F(BoardFolder, RefusesAnEmulatedMachineThatStandsBeyondItsTravel) {
  std::string world{simFile("world.toml")};
  const std::string_view home = "home_mm = [120, 80, -100]";
  ASSERT_NE(world.find(home), std::string::npos);
  write(folder_ / "config" / "world.toml", world.replace(world.find(home), home.size(), "home_mm = [120, 351, 110]"));
  const auto sim = simDescriptions(folder_ / "config");
  ASSERT_FALSE(sim.ok());
  EXPECT_THAT(sim.error().what,
              AllOf(HasSubstr("config/world.toml: 'axes.home_mm'"), HasSubstr("Y = 351"), HasSubstr("-50 to 350 mm"),
                    HasSubstr("board/sim/machine.toml"), HasSubstr("'axes.home_mm'"), HasSubstr("Z = 110"),
                    HasSubstr("-400 to 50 mm"), Not(HasSubstr("has X"))));
}

TEST_F(BoardFolder, RefusesADeviceWhoseLineNobodyBuilt) {
  std::string machine{simFile("machine.toml")};
  const std::string_view line = "trigger = \"tool setter\"";
  ASSERT_NE(machine.find(line), std::string::npos);
  EXPECT_EQ(lineOfToolSetter(simDescriptions()->box, simDescriptions()->machine), 1);
  write(folder_ / "config" / "machine.toml", machine.replace(machine.find(line), line.size(), "trigger = \"touch\""));
  const auto sim = simDescriptions(folder_ / "config");
  ASSERT_FALSE(sim.ok());
  EXPECT_THAT(sim.error().what, testing::AllOf(HasSubstr("'tool_setter.trigger'"), HasSubstr("\"touch\""),
                                               HasSubstr("board/sim/box.toml"), HasSubstr("[[trigger]]"),
                                               HasSubstr("\"probe trigger\""), HasSubstr("\"tool setter\"")));
}

TEST_F(BoardFolder, RefusesGapsAndBoresThatTheStylusBallHasNoWayOutIn) {
  const auto problem = [&](std::string_view section, std::string_view key, const std::string& size) {
    std::string machine{simFile("machine.toml")};
    const auto at = machine.find(key, machine.find(section));
    write(folder_ / "config" / "machine.toml",
          machine.replace(at, machine.find('\n', at) - at, std::string{key} + size));
    const auto sim = simDescriptions(folder_ / "config");
    return sim.ok() ? std::string{} : sim.error().what;
  };
  EXPECT_THAT(problem("\n[datum_plates.Y]", "gap_mm = ", "5"),
              AllOf(HasSubstr("'datum_plates.Y.gap_mm'"), HasSubstr("board/sim/probe.toml"), HasSubstr("6 mm"),
                    HasSubstr("7.6 mm")));
  EXPECT_THAT(problem("\n[datum_plates.X]", "gap_mm = ", "7.6"), HasSubstr("gap_mm"));
  EXPECT_EQ(problem("\n[datum_plates.X]", "gap_mm = ", "7.7"), "");
  EXPECT_THAT(problem("[datum_cylinder]", "diameter_mm = ", "7.6"), HasSubstr("'datum_cylinder.diameter_mm'"));
}

constexpr std::string_view kTriggerProbe =
    "[probe]\nserial_number = \"T1\"\nkind = \"trigger\"\ntrigger = \"probe trigger\"\nrepeatability_um = 0.5\n"
    "deflection_limit_mm = 1\n[stylus]\nball_diameter_mm = 6\n";

TEST_F(BoardFolder, EmulatesTheTouchTriggerProbeThatIsDescribed) {
  EXPECT_FALSE(simDescriptions()->world->touch_trigger);
  write(folder_ / "config" / "probe.toml", kTriggerProbe);
  const auto sim = simDescriptions(folder_ / "config");
  ASSERT_TRUE(sim.ok()) << sim.error().what;
  EXPECT_EQ(lineOfProbeSwitch(sim->box, sim->probe), 0);
  EXPECT_EQ(sim->world->touch_trigger.value().repeatability_um, 0.5);
  // The text of world.toml stands for itself.
  write(folder_ / "config" / "world.toml",
        std::string{simFile("world.toml")} + "[touch_trigger]\npre_travel_mm = 0.02\n");
  EXPECT_EQ(simDescriptions(folder_ / "config")->world->touch_trigger.value().pre_travel_mm, 0.02);
}

TEST_F(BoardFolder, EmulatesTheProbeThatDoesNotTouchAndIsDescribed) {
  const std::string distance =
      "[probe]\nserial_number = \"D1\"\nkind = \"distance\"\nrate_hz = 2000\nnoise_um = 0.4\nstand_off_mm = 20\n"
      "range_mm = 2\n";
  EXPECT_FALSE(simDescriptions()->world->distance_probe);
  write(folder_ / "config" / "probe.toml", distance);
  const auto sim = simDescriptions(folder_ / "config");
  ASSERT_TRUE(sim.ok()) << sim.error().what;
  EXPECT_EQ(sim->probe.by_distance.value().stand_off_mm, 20);
  EXPECT_EQ(sim->world->distance_probe.value().range_mm, 2);
  EXPECT_EQ(sim->world->sphere.stylus_ball_radius_mm, 0) << "there is no ball";
  for (const auto* more : {"[stylus]\nball_diameter_mm = 6\n", "deflection_limit_mm = 1\n", "gain = 1\n"}) {
    write(folder_ / "config" / "probe.toml", distance + more);
    EXPECT_THAT(simDescriptions(folder_ / "config").error().what, HasSubstr("that touches")) << more;
  }
}

TEST_F(BoardFolder, RefusesATouchTriggerProbeThatFilesDescribeDifferently) {
  const auto problem = [&] {
    const auto sim = simDescriptions(folder_ / "config");
    return sim.ok() ? std::string{} : sim.error().what;
  };
  const auto probe = folder_ / "config" / "probe.toml";
  const auto replaced = [](std::string text, std::string_view old, std::string_view by) {
    return text.replace(text.find(old), old.size(), by);
  };
  write(probe, replaced(std::string{kTriggerProbe}, "\"probe trigger\"", "\"switch\""));
  EXPECT_THAT(problem(), testing::AllOf(HasSubstr("'probe.trigger'"), HasSubstr("\"switch\""),
                                        HasSubstr("board/sim/box.toml"), HasSubstr("[[trigger]]")));
  write(probe, replaced(std::string{kTriggerProbe}, "repeatability_um", "noise_um = 0.4\nrepeatability_um"));
  EXPECT_THAT(problem(), HasSubstr("'probe.noise_um'"));
  std::filesystem::remove(probe);
  write(folder_ / "config" / "world.toml",
        std::string{simFile("world.toml")} + "[touch_trigger]\npre_travel_mm = 0.02\n");
  EXPECT_THAT(problem(), HasSubstr("kind = \"trigger\""));
}

TEST_F(BoardFolder, ReadsOrdinaryFilesAlone) {
  const auto problem = [&] { return simDescriptions(folder_ / "config").error().what; };
  const auto box = folder_ / "config" / "box.toml";
  ASSERT_EQ(mkfifo(box.c_str(), 0600), 0);  // would wait for ever where somebody opened it
  EXPECT_THAT(problem(), testing::AllOf(HasSubstr("config/box.toml: it"), HasSubstr("ordinary file")));
  std::filesystem::remove(box);
  std::filesystem::create_directory(box);
  EXPECT_THAT(problem(), testing::AllOf(HasSubstr("config/box.toml: it"), HasSubstr("ordinary file")));
  std::filesystem::remove(box);
  std::filesystem::create_symlink("/dev/zero", box);  // never ends
  EXPECT_THAT(problem(), testing::AllOf(HasSubstr("config/box.toml: it"), HasSubstr("ordinary file")));
  std::filesystem::remove(box);
  std::filesystem::create_symlink("nowhere.toml", box);
  EXPECT_THAT(problem(), HasSubstr("config/box.toml: No such")) << "not the board's own in its place";
  std::filesystem::remove(box);
  write(box, std::string(3'000'000, '#'));
  EXPECT_THAT(problem(), testing::AllOf(HasSubstr("config/box.toml:1: the"), HasSubstr("200000 bytes")));
}

TEST(FileContent, IsTheWholeFileOrTheReasonWhyNot) {
  const support::TemporaryFolder folder;
  const auto file = folder.file("text");
  std::ofstream{file} << std::string(2'500'000, 'x');
  EXPECT_EQ(fileContent(file, 3'000'000)->size(), 2'500'000U);
  EXPECT_EQ(fileContent(file, 2'000'000)->size(), 2'000'000U);
  std::ofstream{file}.close();
  EXPECT_EQ(*fileContent(file), "");
  EXPECT_EQ(fileContent(folder.path()).error().what, "it is a folder");
  EXPECT_EQ(fileContent(folder.file("none")).error().what, "No such file or directory");
  EXPECT_EQ(fileContent("/proc/self/mem").error().what, "Input/output error");
  EXPECT_EQ(fileContent("/dev/zero").error().what, "it is a device, not a file");
}

TEST_F(BoardFolder, RefusesAFileThatNothingWouldRead) {
  write(folder_ / "config" / "machne.toml", simFile("machine.toml"));
  EXPECT_THAT(simDescriptions(folder_ / "config").error().what,
              testing::AllOf(HasSubstr("config/machne.toml"), HasSubstr("machine.toml?")));
  write(folder_ / "config" / "machine.toml", simFile("machine.toml"));
  EXPECT_TRUE(simDescriptions(folder_ / "config").ok()) << "a copy beside it";
}

// A real machine would have the emulated one's travel, sizes and errors of zero.
TEST_F(BoardFolder, RefusesARealMachineThatIsLikeTheEmulatedOne) {
  for (const std::string file : {"box.toml", "probe.toml", "service.toml"})
    write(folder_ / "board" / file, simFile(file));
  write(folder_ / "board" / "machine.toml", "like_sim = true\n");
  EXPECT_THAT(loadDirectory(folder_ / "board").error().what, HasSubstr("like_sim"));
  write(folder_ / "board" / "machine.toml", simFile("machine.toml"));
  EXPECT_TRUE(loadDirectory(folder_ / "board").ok());
}

TEST_F(BoardFolder, NamesEveryFileThatIsMissingOrWrong) {
  write(folder_ / "board" / "box.toml", "[box]\nboard_name = \"b1\"\nserial_number = \"7\"\n[sync]\ncolour = 1\n");
  const auto board = loadDirectory(folder_ / "board");
  ASSERT_FALSE(board.ok());
  EXPECT_THAT(board.error().what, AllOf(HasSubstr("board/box.toml:5: unknown"), HasSubstr("'sync.colour'"),
                                        HasSubstr("board/machine.toml: No"), HasSubstr("board/service.toml: No"),
                                        Not(HasSubstr("world.toml"))));
  EXPECT_THAT(loadDirectory(folder_ / "nowhere").error().what, HasSubstr("such folder"));
  EXPECT_THAT(simDescriptions(folder_ / "nowhere").error().what, HasSubstr("such folder"));
  EXPECT_THAT(loadDirectory(std::string(300, 'a')).error().what, HasSubstr("too long"));
}

}  // namespace
}  // namespace probebox::board
