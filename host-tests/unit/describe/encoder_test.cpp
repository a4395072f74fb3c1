#include <algorithm>
#include <filesystem>
#include <fstream>
#include <gmock/gmock.h>
#include <string>

#include "board/describe/encoder_checks.hpp"
#include "board/describe/parse.hpp"
#include "host-tests/support/temporary_folder.hpp"
#include "machine_with.hpp"
#include "problems.hpp"

// [encoder.AXIS]: how each axis is read, mixed by axis; slips are refused by file, line and remedy.
namespace probebox::board {
namespace {

using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::string_view kCounterX = "[encoder.X]\nkind = \"counter\"\ndevice = \"counter0\"\n";
constexpr std::string_view kLinesC =
    "[encoder.C]\nkind = \"quadrature\"\na = { chip = \"gpiochip0\", line = 20 }\nb = { chip = \"gpiochip0\", line = "
    "21 }\n";

// A box whose encoders are described by axis; the first line of `encoders` is line 15.
std::string boxText(std::string_view encoders, std::string_view devices = "axes", std::string_view more = "") {
  return "[box]\nboard_name = \"b\"\nserial_number = \"7\"\n[sync]\nchip = \"gpiochip0\"\nline = 4\n"
         "period_ns = 1_000_000\n[devices]\nencoders = \"" +
         std::string{devices} + "\"\nencoder_rate_hz = 500\nprobe = \"none\"\n# encoders\n#\n#\n" +
         std::string{encoders} + std::string{more};
}
Box boxWith(std::string_view encoders, std::string_view more = "") {
  auto box = parseBox(boxText(encoders, "axes", more), "box.toml");
  EXPECT_TRUE(box.ok()) << box.error().what;
  return box.ok() ? *box : Box{};
}
std::string with(std::string_view axis_text, std::string_view more) {
  return std::string{axis_text} + std::string{more} + "\n";
}

TEST(Encoders, AreMixedByAxis) {
  const auto box =
      boxWith(with(kCounterX, "count = 1\nbits = 16\nrate_hz = 2000\nindex = true") + std::string{kLinesC});
  const auto& encoders = box.devices.encoders_by_axis;
  ASSERT_TRUE(encoders[0] && encoders[5]);
  EXPECT_FALSE(encoders[1] || encoders[2] || encoders[3] || encoders[4]);
  const auto& counter = std::get<CounterEncoder>(encoders[0]->by);
  EXPECT_EQ(counter.device, "counter0");
  EXPECT_EQ(counter.count, 1);
  EXPECT_EQ(counter.bits, 16);
  EXPECT_EQ(counter.latched_by, LatchedBy::polling);
  EXPECT_TRUE(tellsIndex(*encoders[0]));
  EXPECT_EQ(encoders[0]->rate_hz, 2000);
  EXPECT_EQ(encoders[0]->line, 16U);
  const auto& lines = std::get<QuadratureEncoder>(encoders[5]->by);
  EXPECT_EQ(lines.a.name, "encoder C a");
  EXPECT_EQ(std::get<unsigned>(lines.b.line), 21U);
  EXPECT_EQ(encoders[5]->rate_hz, 500) << "that of [devices]";
  EXPECT_EQ(kindOf(*encoders[5]), "quadrature");
}

TEST(Encoders, ThatTheSyncLineLatchesHaveItsRate) {
  const auto box = boxWith(with(kCounterX, "latched_by = \"capture\"\nlatched_value = \"capture\"\nlatch_channel = 2"));
  EXPECT_EQ(box.devices.encoders_by_axis[0]->rate_hz, 1000);
  EXPECT_EQ(std::get<CounterEncoder>(box.devices.encoders_by_axis[0]->by).latch_channel, 2);
  EXPECT_THAT(problemOfBox(boxText(with(kCounterX, "latched_by = \"index\"\nrate_hz = 100"))),
              AllOf(HasSubstr("box.toml:19: 'encoder.X.rate_hz'"), HasSubstr("1000 Hz"), HasSubstr("remove it")));
  EXPECT_THAT(problemOfBox(boxText(with(kCounterX, "latched_by = \"index\"\nindex = true"))),
              HasSubstr("box.toml:19: 'encoder.X.index' = true"));
}

// The axis counters of a receiver, which need one.
std::string receiverBox(std::string_view encoders) {
  auto text = boxText(encoders);
  return text.replace(text.find("probe = \"none\""), 14, "probe = \"usb\"");
}

TEST(Encoders, OfAReceiverHaveAChannelEachAndTheRateOfItsSamples) {
  const auto box = parseBox(receiverBox("[encoder.X]\nkind = \"receiver\"\nchannel = 3\nindex = true\n"), "box.toml");
  ASSERT_TRUE(box.ok()) << box.error().what;
  const auto& encoder = box->devices.encoders_by_axis[0];
  ASSERT_TRUE(encoder);
  EXPECT_EQ(std::get<ReceiverEncoder>(encoder->by).channel, 3);
  EXPECT_TRUE(tellsIndex(*encoder));
  EXPECT_THAT(problemOfBox(receiverBox("[encoder.X]\nkind = \"receiver\"\nchannel = 8\n")),
              HasSubstr("box.toml:17: 'encoder.X.channel' = 8"));
  EXPECT_THAT(problemOfBox(receiverBox("[encoder.X]\nkind = \"receiver\"\n")),
              testing::AllOf(HasSubstr("missing"), HasSubstr("'encoder.X.channel'")));
  EXPECT_THAT(problemOfBox(receiverBox("[encoder.X]\nkind = \"receiver\"\nchannel = 0\nrate_hz = 100\n")),
              AllOf(HasSubstr("box.toml:18: 'encoder.X.rate_hz'"), HasSubstr("probe.toml: remove")));
}

TEST(Encoders, OfTheControllerAreNumberedByOneCounter) {
  const std::string axis = "kind = \"control\"\nrate_hz = 250\ncounter_rate_hz = 1e6\n";
  const auto box = boxWith("[encoder.X]\n" + axis + "[encoder.C]\n" + axis);
  const auto& encoder = box.devices.encoders_by_axis[5];
  ASSERT_TRUE(encoder);
  EXPECT_EQ(encoder->rate_hz, 250);
  EXPECT_TRUE(encoder->is_absolute);
  EXPECT_EQ(std::get<ControlEncoder>(encoder->by).counter_rate_hz, 1e6);
  const auto usual = boxWith("[encoder.X]\nkind = \"control\"\nrate_hz = 250\n");
  EXPECT_EQ(std::get<ControlEncoder>(usual.devices.encoders_by_axis[0]->by).counter_rate_hz, 250);
  EXPECT_THAT(problemOfBox(boxText("[encoder.X]\n" + axis + "[encoder.Y]\nkind = \"control\"\nrate_hz = 250\n")),
              AllOf(HasSubstr("'encoder.Y'"), HasSubstr("one counter"), HasSubstr("the same")));
}

TEST(Encoders, AndDevicesMustAgree) {
  EXPECT_THAT(problemOfBox(boxText("")), AllOf(HasSubstr("'encoder'"), HasSubstr("each axis")));
  EXPECT_THAT(problemOfBox(boxText(kCounterX, "none")),
              AllOf(HasSubstr("box.toml:15: 'encoder'"), HasSubstr("encoders = \"axes\"")));
  EXPECT_THAT(problemOfBox(boxText("[encoder.X]\nkind = \"receiver\"\n")), HasSubstr("a receiver"));
}

TEST(Encoders, AreRefusedWhereTheyCannotBeRead) {
  EXPECT_THAT(problemOfBox(boxText("[encoder.X]\nkind = \"conter\"\n")), HasSubstr("\"counter\"?"));
  const auto misspelt =
      problemOfBox(boxText("[encoder.X]\nkind = \"quadratur\"\na = { chip = \"gpiochip0\", line = 20 }\nb = { chip = "
                           "\"gpiochip0\", line = 21 }\nrate_hz = 5\n"));
  EXPECT_THAT(misspelt, HasSubstr("\"quadrature\"?"));
  EXPECT_EQ(std::ranges::count(misspelt, '\n'), 0) << "one message: " << misspelt;
  EXPECT_THAT(problemOfBox(boxText("[encoder.X]\nkind = \"counter\"\n")),
              testing::AllOf(HasSubstr("box.toml:15: missing"), HasSubstr("'encoder.X.device'")));
  EXPECT_THAT(problemOfBox(boxText(with(kCounterX, "bits = 4"))), testing::AllOf(HasSubstr("8 to"), HasSubstr("64")));
  EXPECT_THAT(problemOfBox(boxText(with(kLinesC, "absolute = true"))), HasSubstr("only count"));
  EXPECT_THAT(problemOfBox(boxText(with(kCounterX, "") + "[encoder.Y]\nkind = \"counter\"\ndevice = \"counter0\"\n")),
              testing::AllOf(HasSubstr("box.toml:19: 'encoder.Y'"), HasSubstr("[encoder.X]"), HasSubstr("'device'"),
                             HasSubstr("'count'")));
}

std::string kernelCounter(char letter, std::string_view more) {
  return "[encoder." + std::string{letter} + "]\nkind = \"counter\"\n" + std::string{more} + "\n";
}

// The kernel has one list of watched events for a device, and one queue.
TEST(Encoders, OfOneDeviceMayHaveTheEventsOfOneOnly) {
  constexpr std::string_view kQuad = "device = \"104-quad-8\"\n", kMark = "index = true\n";
  const auto with_mark = [&](int count) {
    const auto number = std::to_string(count);
    return std::string{kQuad} + "count = " + number + "\n" + std::string{kMark} + "index_channel = " + number;
  };
  const std::string polled = std::string{kQuad} + "count = 1",
                    latched = polled + "\nlatched_by = \"capture\"\nlatch_channel = 1";
  for (const auto& second : {with_mark(1), latched})
    EXPECT_THAT(problemOfBox(boxText(kernelCounter('X', with_mark(0)) + kernelCounter('Y', second))),
                AllOf(HasSubstr("'encoder.Y'"), HasSubstr("[encoder.X]"), HasSubstr("poll"), HasSubstr("[[index]]")));
  EXPECT_THAT(problemOfBox(boxText(kernelCounter('X', with_mark(0)) + kernelCounter('Y', polled) +
                                   kernelCounter('Z', exchanged(with_mark(2), "104-quad-8", "/dev/104-quad-8")))),
              testing::AllOf(HasSubstr("'encoder.Z'"), HasSubstr("[encoder.X]")));
  boxWith(kernelCounter('X', with_mark(0)) + kernelCounter('Y', polled));
  boxWith(kernelCounter('X', with_mark(0)) +
          kernelCounter('Y', std::string{"device = \"other\"\n"} + std::string{kMark}));
}

TEST(Encoders, ThatCountLinesNeedTwoFreeOnesOfOneChip) {
  auto text = std::string{kLinesC};
  text.replace(text.find("line = 21"), 9, "line = 4");
  EXPECT_THAT(problemOfBox(boxText(text)), testing::AllOf(HasSubstr("\"encoder C b\""), HasSubstr("\"sync\"")));
  text = kLinesC;
  text.replace(text.rfind("gpiochip0"), 9, "gpiochip1");
  EXPECT_THAT(problemOfBox(boxText(text)),
              AllOf(HasSubstr("'encoder.C.b'"), HasSubstr("\"gpiochip1\""), HasSubstr("one chip")));
}

TEST(Encoders, HaveOneIndexInputAtMost) {
  const std::string index = "[[index]]\naxis = \"X\"\nchip = \"gpiochip0\"\nline = 9\n";
  EXPECT_THAT(problemOfBox(boxText(with(kCounterX, "index = true"), "axes", index)),
              testing::AllOf(HasSubstr("[[index]]"), HasSubstr("for X")));
  EXPECT_THAT(problemOfBox(boxText("[encoder.B]\nkind = \"counter\"\ndevice = \"c\"\nindex = true\n")),
              HasSubstr("rotary axes"));
}

std::vector<std::string> problemsWith(std::string_view encoders, std::string_view machine) {
  auto described = machineWith(machine);
  EXPECT_TRUE(described.ok()) << described.error().what;
  return encoderProblems(boxWith(encoders), "box.toml", *described, "machine.toml");
}

TEST(Encoders, AgreeWithTheMachine) {
  constexpr std::string_view kTurningC =
      "[rotary_axis.C]\nangle_from = \"encoder\"\ncounts_per_deg = 10\nsense = 1\nmaximum_speed_deg_s = 360\n";
  EXPECT_THAT(problemsWith(std::string{kCounterX} + std::string{kLinesC}, kTurningC), IsEmpty());
  EXPECT_THAT(problemsWith(kCounterX, kTurningC),
              ElementsAre(AllOf(HasSubstr("machine.toml: '[rotary_axis.C]'"), HasSubstr("angle_from = \"encoder\""),
                                HasSubstr("[encoder.C]"))));
  EXPECT_THAT(problemsWith(kLinesC, ""),
              ElementsAre(AllOf(HasSubstr("box.toml:16: 'encoder.C'"), HasSubstr("[rotary_axis.C]"),
                                HasSubstr("angle_from = \"encoder\""), HasSubstr("machine.toml"))));
}

TEST(Encoders, OfSecondaryAxesAgreeWithTheMachineToo) {
  constexpr std::string_view kQuill = "[encoder.U]\nkind = \"counter\"\ndevice = \"counter7\"\nbits = 16\n",
                             kAxis = "[axis.U]\ncounts_per_mm = 1000\nsense = 1\n";
  const auto both = std::string{kCounterX} + std::string{kQuill};
  EXPECT_THAT(problemsWith(both, kAxis), IsEmpty());
  EXPECT_THAT(problemsWith(both, ""),
              ElementsAre(AllOf(HasSubstr("'encoder.U'"), HasSubstr("[axis.U]"), HasSubstr("machine.toml"))));
  EXPECT_THAT(problemsWith(kCounterX, kAxis),
              ElementsAre(testing::AllOf(HasSubstr("machine.toml: '[axis.U]'"), HasSubstr("box.toml"),
                                         HasSubstr("[encoder.U]"))));
  EXPECT_THAT(problemsWith(both, std::string{kAxis} + "maximum_speed_mm_s = 10000\n"),
              ElementsAre(AllOf(HasSubstr("'encoder.U'"), HasSubstr("16 bits"), HasSubstr("'maximum_speed_mm_s'"),
                                HasSubstr("[axis.U]"))));
}

// 1000 counts/mm at 1000 mm/s are 32 768 counts in 33 ms.
TEST(Encoders, AreReadOftenEnoughToTellATurnOfTheCounter) {
  EXPECT_THAT(problemsWith(with(kCounterX, "bits = 16\nrate_hz = 400"), ""), IsEmpty());
  EXPECT_THAT(problemsWith(with(kCounterX, "bits = 16\nrate_hz = 200"), ""),
              ElementsAre(AllOf(HasSubstr("box.toml:16: 'encoder.X'"), HasSubstr("16 bits"), HasSubstr("32.768 ms"),
                                HasSubstr("306 Hz"))));
  EXPECT_THAT(problemsWith(with(kCounterX, "bits = 32\nrate_hz = 1"), ""), IsEmpty()) << "2147 s";
  EXPECT_THAT(
      problemsWith(
          "[encoder.Y]\nkind = \"quadrature\"\na = { chip = \"g\", line = 1 }\nb = { chip = \"g\", line = 2 }\n", ""),
      ElementsAre(AllOf(HasSubstr("'encoder.Y'"), HasSubstr("5000"), HasSubstr("edges/s"), HasSubstr("1000000"),
                        HasSubstr("'maximum_speed_mm_s'"), HasSubstr("[axis.Y]"), HasSubstr("machine.toml"))));
}

TEST(Encoders, AreReferencedAsTheMachineSays) {
  constexpr std::string_view kAbsoluteC =
      "[rotary_axis.C]\nangle_from = \"encoder\"\ncounts_per_deg = 10\nsense = 1\nreference = \"absolute\"\n";
  constexpr std::string_view kCounterC = "[encoder.C]\nkind = \"counter\"\ndevice = \"counter1\"\n";
  EXPECT_THAT(problemsWith(kCounterC, kAbsoluteC),
              ElementsAre(AllOf(HasSubstr("box.toml:16: 'encoder.C'"), HasSubstr("absolute = true"))));
  EXPECT_THAT(problemsWith(with(kCounterC, "absolute = true"), kAbsoluteC), IsEmpty());
}

TEST(Encoders, NeedAnIndexWhereTheMachineIsReferencedByIt) {
  auto machine = machineWith("");
  ASSERT_TRUE(machine.ok());
  machine->axes[0].reference = {.by = ReferenceBy::index, .has_index = true};
  const auto problems = [&](const Box& box) { return encoderProblems(box, "box.toml", *machine, "machine.toml"); };
  EXPECT_THAT(problems(boxWith(kCounterX)), ElementsAre(AllOf(HasSubstr("box.toml:16: 'encoder.X'"),
                                                              HasSubstr("[[index]]"), HasSubstr("axis = \"X\""))));
  EXPECT_THAT(problems(boxWith(with(kCounterX, "index = true"))), IsEmpty());
  EXPECT_THAT(problems(boxWith(kCounterX, "[[index]]\naxis = \"X\"\nchip = \"gpiochip0\"\nline = 9\n")), IsEmpty());
}

std::string frontEndText(std::string_view keys, std::string_view probe = "usb") {
  auto text = boxText("", "none", "[front_end]\n" + std::string{keys} + "\n");
  const auto at = text.find("probe = \"none\"");
  return text.replace(at, 14, "probe = \"" + std::string{probe} + "\"");
}

TEST(FrontEndSection, SaysWhatTheFrontEndIsTold) {
  const auto usual = parseBox(frontEndText(""), "box.toml");
  ASSERT_TRUE(usual) << usual.error().what;
  EXPECT_EQ(usual->front_end->samples_a_packet, 10);
  EXPECT_FALSE(usual->front_end->sync_out_hz);
  const auto box =
      parseBox(frontEndText("full_scale_um = [500, -500, 2000]\nsync_out_hz = 500\nsamples_a_packet = 4"), "box.toml");
  ASSERT_TRUE(box) << box.error().what;
  EXPECT_THAT(box->front_end->full_scale_um, ElementsAre(500, -500, 2000));
  EXPECT_EQ(box->front_end->sync_out_hz, 500);
  EXPECT_EQ(box->front_end->samples_a_packet, 4);
  EXPECT_FALSE(parseBox(boxText("", "none"), "box.toml")->front_end);
}

TEST(FrontEndSection, RefusesWhatNoFrontEndTakes) {
  for (const auto* const keys : {"full_scale_um = [500, 0, 500]", "full_scale_um = [500, 500, 200_000]",
                                 "sync_out_hz = 0.5", "sync_out_hz = 200_000", "samples_a_packet = 33"})
    EXPECT_FALSE(parseBox(frontEndText(keys), "box.toml")) << keys;
  EXPECT_FALSE(parseBox(frontEndText("", "none"), "box.toml")) << "there is no receiver on USB";
}

}  // namespace
}  // namespace probebox::board
