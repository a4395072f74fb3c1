#include <gmock/gmock.h>
#include <string>

#include "machine_with.hpp"
#include "problems.hpp"

// U, V and W are refused wherever a description may name an axis: place, reason and remedy.
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
               HasSubstr("remove it, and let the control send the sum of both as its position of " + primary),
               Not(HasSubstr("did you mean")), Not(HasSubstr("unknown key")));
}

TEST(SecondaryAxes, AreRefusedInBoxToml) {
  const auto problem = [](const std::string& more) {
    return problemOfBox(kBoxOfAxes + std::string{"[encoder.X]\nkind = \"control\"\n"} + more);
  };
  EXPECT_THAT(problem("[encoder.V]\nkind = \"control\"\n"), refuses("box.toml:15: 'encoder.V'", "V", "Y"));
  EXPECT_THAT(problem("[[index]]\naxis = \"U\"\nchip = \"gpiochip0\"\nline = 9\n"),
              refuses("box.toml:16: 'index.axis'", "U", "X"));
  EXPECT_THAT(problem("[[drift]]\naxis = \"W\"\ndevice = \"d\"\nchannel = \"voltage0\"\num_per_unit = 1\n"),
              refuses("box.toml:16: 'drift.axis'", "W", "Z"));
}

TEST(SecondaryAxes, AreRefusedInMachineToml) {
  EXPECT_THAT(machineProblem("[axis.U]\ncounts_per_mm = 1000\n"), refuses("machine.toml:26: 'axis.U'", "U", "X"));
  EXPECT_THAT(machineProblem("[screw.V]\nlength_mm = 800\n"), refuses("machine.toml:26: 'screw.V'", "V", "Y"));
  EXPECT_THAT(machineProblem("[rotary_axis.W]\nsense = 1\n"), refuses("machine.toml:26: 'rotary_axis.W'", "W", "Z"));
}

}  // namespace
}  // namespace probebox::board
