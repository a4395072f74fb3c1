#include <gmock/gmock.h>
#include <string>

#include "machine_with.hpp"
#include "problems.hpp"

// U, V and W have encoders, which are added to those of X, Y and Z; everywhere else they are refused: place, reason and
// remedy.
namespace probebox::board {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

constexpr const char* kBoxOfAxes =
    "[box]\nboard_name = \"b\"\nserial_number = \"7\"\n[sync]\nchip = \"gpiochip0\"\nline = 4\nperiod_ns = 1_000_000\n"
    "[devices]\nencoders = \"axes\"\nencoder_rate_hz = 500\nprobe = \"none\"\ndrift = \"iio\"\n";

auto refuses(const std::string& place, const std::string& secondary, const std::string& primary) {
  return AllOf(HasSubstr(place + " names the secondary axis " + secondary + ", parallel to " + primary + " (ISO 841)"),
               HasSubstr("[axis." + secondary + "] in machine.toml add its position to that of " + primary),
               Not(HasSubstr("did you mean")), Not(HasSubstr("unknown key")));
}

TEST(SecondaryAxes, AreRefusedInBoxToml) {
  const auto problem = [](const std::string& more) {
    return problemOfBox(kBoxOfAxes + std::string{"[encoder.X]\nkind = \"control\"\n"} + more);
  };
  EXPECT_THAT(problem("[[index]]\naxis = \"U\"\nchip = \"gpiochip0\"\nline = 9\n"),
              refuses("box.toml:16: 'index.axis'", "U", "X"));
  EXPECT_THAT(problem("[[drift]]\naxis = \"W\"\ndevice = \"d\"\nchannel = \"voltage0\"\num_per_unit = 1\n"),
              refuses("box.toml:16: 'drift.axis'", "W", "Z"));
}

TEST(SecondaryAxes, AreRefusedInMachineToml) {
  EXPECT_THAT(machineProblem("[screw.V]\nlength_mm = 800\n"), refuses("machine.toml:26: 'screw.V'", "V", "Y"));
  EXPECT_THAT(machineProblem("[rotary_axis.W]\nsense = 1\n"), refuses("machine.toml:26: 'rotary_axis.W'", "W", "Z"));
}

const std::string kWithoutSensors = exchanged(kBoxOfAxes, "drift = \"iio\"", "drift = \"none\"");

std::string encoder(char letter, const std::string& kind) {
  return "[encoder." + std::string{letter} + "]\nkind = " + kind + "\n";
}
std::string counted(char letter, int number, const std::string& more = {}) {
  return encoder(letter, "\"counter\"\ndevice = \"counter" + std::to_string(number) + "\"\n" + more);
}

TEST(SecondaryAxes, HaveEncodersOfTheirOwn) {
  const auto box = parseBox(kWithoutSensors + counted('Z', 0) + counted('W', 1), "box.toml");
  ASSERT_TRUE(box) << box.error().what;
  ASSERT_TRUE(box->devices.secondary_encoders[2]);
  EXPECT_EQ(std::get<CounterEncoder>(box->devices.secondary_encoders[2]->by).device, "counter1");
  EXPECT_EQ(&encoderOf(box->devices, kAllEncoderAxes.find('W')), &box->devices.secondary_encoders[2]);
}

TEST(SecondaryAxes, NeedWhatTheyAreAddedTo) {
  const auto problem = [](const std::string& encoders) { return problemOfBox(kWithoutSensors + encoders); };
  EXPECT_THAT(problem(counted('Y', 0) + counted('W', 1)), HasSubstr("box.toml:17: 'encoder.W'"));
  EXPECT_THAT(problem(counted('Z', 0) + counted('W', 0)), AllOf(HasSubstr("'encoder.W'"), HasSubstr("[encoder.Z]")));
  EXPECT_THAT(problem(encoder('Z', "\"control\"") + counted('W', 0)), HasSubstr("the control"));
  EXPECT_THAT(problem(counted('Z', 0) + encoder('W', "\"control\"")), HasSubstr("the control"));
  EXPECT_THAT(problem(counted('Z', 0, "absolute = true") + counted('W', 1)), HasSubstr("is absolute"));
  EXPECT_THAT(problem(counted('Z', 0) + counted('W', 1, "index = true")), HasSubstr("of W"));
}

TEST(SecondaryAxes, AreDescribedAsTheAxesThatTheyAreAddedTo) {
  const std::string quill = "[axis.W]\ncounts_per_mm = 2000\nsense = -1\n";
  const auto machine = machineWith(quill);
  ASSERT_TRUE(machine) << machine.error().what;
  ASSERT_TRUE(machine->secondary_axes[2]);
  EXPECT_EQ(machine->secondary_axes[2]->counts_per_mm, 2000);
  EXPECT_EQ(machine->secondary_axes[2]->sense, -1);
  EXPECT_THAT(machineProblem(quill + "sense = 0\n"), HasSubstr("sense"));
  EXPECT_THAT(machineProblem(quill + "travel_min_mm = 0\n"), HasSubstr("travel_min_mm"));
  EXPECT_THAT(machineProblem(quill + "[screw.Z]\nlength_mm = 800\n"), AllOf(HasSubstr("'screw.Z'"), HasSubstr("of Z")));
}

}  // namespace
}  // namespace probebox::board
