#include <array>
#include <cstddef>
#include <fstream>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sstream>
#include <string>

#include "board/describe/parse.hpp"
#include "host-tests/support/temporary_folder.hpp"
#include "problems.hpp"

// Sensors on converters: what box.toml says of them, and what it refuses.
namespace probebox::board {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

const std::string kProbe = R"([probe_adc]
device = "ad7606-8"
trigger = "sync-trigger"
channels = ["voltage0", "voltage1", "voltage2"]
um_per_unit = [0.2, 0.2, -0.2]
zero_unit = [0, 0, 2500]
)";
const std::string kScrew = R"([[drift]]
axis = "X"
device = "ads1115"
channel = "voltage0"
um_per_unit = 0.5
)";

std::string boxToml(const std::string& probe, const std::string& drift, const std::string& sections) {
  return R"([box]
board_name = "bench"
serial_number = "1"
[sync]
chip = "gpiochip0"
line = 0
period_ns = 1_000_000
[devices]
encoders = "none"
encoder_rate_hz = 1000
probe = ")" +
         probe + "\"\ndrift = \"" + drift + "\"\n" + sections;  // the first section is in line 13
}

std::string probeProblem(std::string_view from, std::string_view to) {
  return problemOfBox(boxToml("iio", "none", exchanged(kProbe, from, to)));
}
std::string screwProblem(std::string_view from, std::string_view to) {
  return problemOfBox(boxToml("none", "iio", exchanged(kScrew, from, to)));
}

TEST(Sensors, AreReadAsDescribed) {
  const auto box = parseBox(boxToml("iio", "iio", kProbe + kScrew + R"([[drift]]
axis = "Z"
device = "ad7606-8"
channel = "voltage5"
um_per_unit = -4
buffered = true
rate_hz = 2000
)"),
                            "box.toml");
  ASSERT_TRUE(box.ok()) << box.error().what;
  EXPECT_EQ(box->devices.probe, "iio");
  EXPECT_EQ(box->devices.drift, "iio");
  const auto& probe = box->sensors.probe;
  ASSERT_TRUE(probe);
  EXPECT_EQ(probe->device, "ad7606-8");
  EXPECT_EQ(probe->trigger, "sync-trigger");
  EXPECT_EQ(probe->channels[1], "voltage1");
  EXPECT_EQ(probe->um_per_unit[2], -0.2);
  EXPECT_EQ(probe->zero_unit[2], 2500);
  const auto& drift = box->sensors.drift;
  ASSERT_EQ(drift.size(), 2U);
  EXPECT_EQ(drift[0].axis, 0);
  EXPECT_EQ(drift[0].channel, "voltage0");
  EXPECT_EQ(drift[0].um_per_unit, 0.5);
  EXPECT_FALSE(drift[0].buffered);
  EXPECT_EQ(drift[0].rate_hz, 10);
  EXPECT_EQ(drift[1].axis, 2);
  EXPECT_TRUE(drift[1].buffered);
  EXPECT_EQ(drift[1].rate_hz, 2000);
}

TEST(Sensors, GoWithTheirWordInDevices) {
  EXPECT_THAT(problemOfBox(boxToml("iio", "none", "")),
              AllOf(HasSubstr("box.toml:11: 'devices.probe' = \"iio\""), HasSubstr("add [probe_adc]")));
  EXPECT_THAT(problemOfBox(boxToml("none", "iio", "")),
              AllOf(HasSubstr("box.toml:12: 'devices.drift' = \"iio\""), HasSubstr("add a [[drift]]")));
  EXPECT_THAT(problemOfBox(boxToml("none", "none", kProbe)),
              AllOf(HasSubstr("box.toml:13: 'probe_adc'"), HasSubstr("\"iio\""), HasSubstr("or remove")));
  EXPECT_THAT(problemOfBox(boxToml("none", "none", kScrew)),
              AllOf(HasSubstr("box.toml:13: 'drift'"), HasSubstr("\"iio\""), HasSubstr("or remove")));
  EXPECT_THAT(problemOfBox(boxToml("iio", "ads1115", kProbe)),
              AllOf(HasSubstr("box.toml:12: 'devices.drift' = \"ads1115\""), HasSubstr("\"iio\"")));
}

TEST(Sensors, AreRefusedWithLineAndRemedy) {
  EXPECT_THAT(screwProblem("channel =", "chanel ="),
              testing::AllOf(HasSubstr("box.toml:16: unknown"), HasSubstr("'drift.chanel'")));
  EXPECT_THAT(
      screwProblem("\"voltage0\"", "\"in_voltage0_raw\""),
      AllOf(HasSubstr("box.toml:16: 'drift.channel'"), HasSubstr("in_voltage0_raw"), HasSubstr("\"voltage0\"")));
  EXPECT_THAT(screwProblem("um_per_unit = 0.5", "um_per_unit = 0"),
              AllOf(HasSubstr("box.toml:17: 'drift.um_per_unit' = 0"), HasSubstr("um")));
  EXPECT_THAT(screwProblem("\"X\"", "\"Q\""), HasSubstr("box.toml:14: 'drift.axis' = \"Q\""));
  EXPECT_THAT(screwProblem("um_per_unit = 0.5", "um_per_unit = 0.5\nrate_hz = 1000"),
              HasSubstr("'drift.rate_hz' = 1000"));
  EXPECT_THAT(screwProblem("um_per_unit = 0.5", "um_per_unit = 0.5\nbuffered = true"),
              testing::AllOf(HasSubstr("missing"), HasSubstr("'drift.rate_hz'")));
  EXPECT_THAT(probeProblem(", \"voltage2\"]", "]"), HasSubstr("box.toml:16: 'probe_adc.channels'"));
  EXPECT_THAT(probeProblem("\"voltage2\"", "\"voltage1\""),
              AllOf(HasSubstr("box.toml:16: 'probe_adc.channels' = \"voltage1\""), HasSubstr("\"ad7606-8\""),
                    HasSubstr("of its")));
  EXPECT_THAT(probeProblem("\"voltage2\"", "\"Voltage2\""), HasSubstr("the name"));
}

TEST(Sensors, OneChannelOrAxisIsNotReadTwice) {
  EXPECT_THAT(problemOfBox(boxToml("none", "iio", kScrew + exchanged(kScrew, "voltage0", "voltage1"))),
              testing::AllOf(HasSubstr("box.toml:19: 'drift.axis' = \"X\""), HasSubstr("[[drift]]")));
  EXPECT_THAT(problemOfBox(boxToml("none", "iio", kScrew + exchanged(kScrew, "\"X\"", "\"Y\""))),
              testing::AllOf(HasSubstr("box.toml:21: 'drift.channel' = \"voltage0\""), HasSubstr("\"ads1115\"")));
  const auto other_rate = exchanged(exchanged(kScrew, "\"X\"", "\"Y\""), "voltage0\"", "voltage1\"\nrate_hz = 20");
  EXPECT_THAT(problemOfBox(boxToml("none", "iio", kScrew + other_rate)), HasSubstr("all its"));
}

// A vendor's example is one that a box takes.
TEST(Boards, WithAReceiverAreDescribedWhole) {
  const auto board = loadDirectory(BOARDS "/receiver");
  ASSERT_TRUE(board.ok()) << board.error().what;
  EXPECT_EQ(board->box.devices.probe, "usb");
  EXPECT_EQ(board->box.devices.drift, "iio");
  for (const std::size_t axis : {0U, 1U, 2U, 5U})
    EXPECT_EQ(kindOf(board->box.devices.encoders_by_axis.at(axis).value()), "receiver") << axis;
}

TEST(Boards, WithAFrontEndNeedNoGpioChip) {
  for (const char* const name : {"panel-pc", "raspberry-pi", "front-end/arm64"}) {
    const auto board = loadDirectory(std::string{BOARDS "/"} + name);
    ASSERT_TRUE(board.ok()) << board.error().what;
    EXPECT_EQ(board->box.sync.receiver, 0);
    EXPECT_EQ(board->box.triggers.at(0).receiver, 1);
    EXPECT_EQ(board->box.skips.at(0).receiver, 2);
    EXPECT_EQ(board->box.inhibits.at(0).receiver, 3);
  }
}

TEST(Boards, MayHaveASecondFrontEndForEightAxes) {
  const auto board = loadDirectory(BOARDS "/front-end/eight-axes");
  ASSERT_TRUE(board.ok()) << board.error().what;
  ASSERT_TRUE(board->box.second_receiver);
  EXPECT_NE("usb:" + board->box.second_receiver->serial_number, board->box.devices.probe);
  std::array<std::size_t, kReceivers> axes{};
  for (std::size_t place = 0; place < kAllEncoderAxes.size(); ++place)
    if (const auto& encoder = encoderOf(board->box.devices, place))
      ++axes.at(std::get<ReceiverEncoder>(encoder->by).receiver_number);
  EXPECT_EQ(axes, (std::array<std::size_t, kReceivers>{4, 4}));
}

TEST(SecondReceiver, IsRefusedWithoutWhatTellsItFromTheFirst) {
  std::ostringstream text;
  text << std::ifstream{BOARDS "/front-end/eight-axes/box.toml"}.rdbuf();
  const auto problem = [&](std::string_view from, const std::string& to) {
    const auto box = parseBox(exchanged(text.str(), from, to), "box.toml");
    return box ? std::string{} : box.error().what;
  };
  ASSERT_EQ(problem("[sync]", "[sync]"), "");
  EXPECT_THAT(problem("\"usb:E66058388340\"", "\"usb\""), HasSubstr("'receiver_2'"));
  EXPECT_THAT(problem("\"E66058388341\"", "\"E66058388340\""), HasSubstr("'receiver_2'"));
  EXPECT_THAT(problem("receiver = \"sync\"", "chip = \"gpiochip0\"\nline = 4"), HasSubstr("'receiver_2'"));
  EXPECT_THAT(problem("receiver = \"sync\"", "receiver = \"sync\"\nreceiver_number = 2"), HasSubstr("'sync'"));
  EXPECT_THAT(problem("period_ns = 1_000_000", "period_ns = 100_000"), HasSubstr("'receiver_2'"));
  EXPECT_THAT(problem("[receiver_2]\nserial_number = \"E66058388341\"", ""), HasSubstr("'receiver_2'"));
  EXPECT_THAT(problem("receiver_number = 2\nchannel = 0", "channel = 0"), HasSubstr("encoder"));
  EXPECT_THAT(problem("receiver = \"trigger-2\"", "receiver = \"trigger-2\"\nreceiver_number = 3"),
              HasSubstr("receiver_number"));
  EXPECT_EQ(problem("receiver = \"trigger-2\"", "receiver = \"trigger-1\"\nreceiver_number = 2"), "")
      << "the same line of the other one";
}

std::string problemOfFrontEnd(std::string_view from, const std::string& to) {
  std::ostringstream text;
  text << std::ifstream{BOARDS "/panel-pc/box.toml"}.rdbuf();
  const auto box = parseBox(exchanged(text.str(), from, to), "box.toml");
  return box ? std::string{} : box.error().what;
}

TEST(ReceiverLines, AreOnTheReceiverOrOnAChip) {
  EXPECT_THAT(problemOfFrontEnd("receiver = \"sync\"", "receiver = \"sync\"\nchip = \"gpiochip0\""),
              HasSubstr("'sync.chip'"));
  EXPECT_THAT(problemOfFrontEnd("receiver = \"trigger-2\"", "receiver = \"trigger-1\""), HasSubstr("'skip.receiver'"));
  EXPECT_THAT(problemOfFrontEnd("receiver = \"inhibit\"", "receiver = \"cut\""), HasSubstr("'inhibit.receiver'"));
  EXPECT_THAT(problemOfFrontEnd("probe = \"usb\" ", "probe = \"none\" "), HasSubstr("'sync'"));
}

// The board with a receiver, with `from` of the named file cut out up to `to`.
Outcome<Descriptions> receiverWithout(const std::string& file, std::string_view from, std::string_view to) {
  const support::TemporaryFolder folder;
  for (const char* const name : {"box.toml", "machine.toml", "probe.toml", "service.toml"}) {
    std::ostringstream text;
    text << std::ifstream{std::string{BOARDS "/receiver/"} + name}.rdbuf();
    auto changed = text.str();
    if (name == file) {
      const auto begin = changed.find(from);
      changed.erase(begin, changed.find(to, begin + 1) - begin);
    }
    std::ofstream{folder.file(name)} << changed;
  }
  return loadDirectory(folder.path());
}

// Two files that must agree.
TEST(Sensors, OfAScrewThatMachineTomlDoesNotDescribeAreRefused) {
  const auto board = receiverWithout("machine.toml", "[screw.Z]", "# The rotary table");
  ASSERT_FALSE(board.ok());
  EXPECT_THAT(board.error().what, AllOf(HasSubstr("[[drift]]"), HasSubstr("axis = \"Z\""), HasSubstr("[screw.Z]"),
                                        HasSubstr("the sensor")));
}

TEST(Sensors, AreMissedOfAScrewThatMachineTomlDescribes) {
  const auto board = receiverWithout("box.toml", "[[drift]]\naxis = \"X\"", "[[drift]]\naxis = \"Y\"");
  ASSERT_FALSE(board.ok());
  EXPECT_THAT(board.error().what,
              AllOf(HasSubstr("[screw.X]"), HasSubstr("[[drift]]"), HasSubstr("axis = \"X\""), HasSubstr("the screw")));
}

}  // namespace
}  // namespace probebox::board
