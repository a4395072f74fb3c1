#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "tools/probebox/text/report_factory.hpp"

namespace probebox::command {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using Verdict = MeasuredCheck::Verdict;
using BoxStatus = messages::Status::Answer;

std::vector<Verdict> verdictsOf(const std::vector<MeasuredCheck>& checks) {
  std::vector<Verdict> all;
  for (const auto& check : checks) all.push_back(check.verdict);
  return all;
}

BoxStatus withLines(std::uint64_t trigger, std::uint64_t index, std::uint64_t lost) {
  BoxStatus status;
  status.lines = {{.name = "sync", .role = 0, .edges = 5},
                  {.name = "probe trigger", .role = 1, .edges = trigger, .lost = lost},
                  {.name = "index X", .role = 2, .edges = index}};
  return status;
}

TEST(FactoryLines, EachHasToBeDrivenWhileSamplesAreReceived) {
  const auto before = withLines(7, 0, 2);
  const auto idle = lineChecks(before, before);
  EXPECT_THAT(verdictsOf(idle), ElementsAre(Verdict::failed, Verdict::failed)) << "and sync has a line of its own";
  EXPECT_EQ(idle.front().name, "line-probe trigger");
  EXPECT_THAT(verdictsOf(lineChecks(before, withLines(8, 2, 2))), ElementsAre(Verdict::passed, Verdict::passed));
  EXPECT_THAT(verdictsOf(lineChecks(before, withLines(90, 2, 3))), ElementsAre(Verdict::failed, Verdict::passed))
      << "an edge was lost";
  EXPECT_THAT(verdictsOf(lineChecks({}, withLines(1, 1, 0))), ElementsAre(Verdict::passed, Verdict::passed));
  EXPECT_THAT(lineChecks({}, {}), IsEmpty());
}

TEST(FactoryEncoders, EachHasToMoveByMoreThanVibration) {
  const std::vector<AxisMotion> axes{{"position_x", 4, 4.2}, {"position_y", -1.01, -1.0}};
  const auto checks = encoderChecks(axes, 1);
  EXPECT_THAT(verdictsOf(checks), ElementsAre(Verdict::passed, Verdict::failed, Verdict::passed));
  EXPECT_EQ(checks[1].name, "encoder-position_y");
  EXPECT_THAT(verdictsOf(encoderChecks({}, 0)), ElementsAre(Verdict::not_told)) << "an encoder may have no mark";
}

TEST(FactoryController, HasToBeAnsweredWithoutABadFrame) {
  BoxStatus before, after;
  EXPECT_THAT(verdictsOf(controllerChecks(before, after)), ElementsAre(Verdict::not_told));
  before.cnc_lines = {{.name = "/dev/ttyS0", .answered = 10, .bad_frames = 3}};
  after = before;
  EXPECT_THAT(verdictsOf(controllerChecks(before, after)), ElementsAre(Verdict::failed));
  after.cnc_lines.front().answered = 12;
  EXPECT_THAT(verdictsOf(controllerChecks(before, after)), ElementsAre(Verdict::passed)) << "bad ones were before";
  after.cnc_lines.front().bad_frames = 4;
  EXPECT_THAT(verdictsOf(controllerChecks(before, after)), ElementsAre(Verdict::failed));
  after.cnc_lines.front() = {.name = "/dev/ttyS0", .answered = 12, .bad_frames = 3, .unsent = 1};
  EXPECT_THAT(verdictsOf(controllerChecks(before, after)), ElementsAre(Verdict::failed));
}

TEST(FactoryUsb, NumbersForTestsAreNotShipped) {
  const auto verdict = [](std::uint16_t vendor, std::uint16_t product, bool provisioned = true) {
    return usbNumbersCheck({.provisioned = provisioned, .usb_vendor_id = vendor, .usb_product_id = product}).verdict;
  };
  EXPECT_EQ(verdict(0x1209, 0x0001), Verdict::failed);
  EXPECT_EQ(verdict(0x1209, 0x0010), Verdict::failed);
  EXPECT_EQ(verdict(0x1209, 0x0011), Verdict::passed) << "of a project that pid.codes has given it";
  EXPECT_EQ(verdict(0x0483, 0x0001), Verdict::passed);
  EXPECT_EQ(verdict(0, 0, false), Verdict::failed);
}

TEST(FactoryUpdateKey, IsTheOneThatTheVendorNamed) {
  const auto verdict = [](std::vector<std::string> image, std::vector<std::string> named) {
    return updateKeyCheck({.update_keys = std::move(named), .image_keys = std::move(image)}).verdict;
  };
  EXPECT_EQ(verdict({}, {"a"}), Verdict::not_told) << "no image";
  EXPECT_EQ(verdict({"a"}, {"a"}), Verdict::passed);
  EXPECT_EQ(verdict({"a", "b"}, {"b", "a"}), Verdict::passed);
  EXPECT_EQ(verdict({"a"}, {}), Verdict::failed) << "such as the key for development";
  EXPECT_EQ(verdict({"a", "b"}, {"a"}), Verdict::failed) << "a stranger's as well";
}

TEST(FactoryTimeSource, IsWhateverTellsTheDate) {
  const auto check = [](std::string utc, std::string source) {
    BoxStatus status;
    status.utc = std::move(utc);
    status.date_source = std::move(source);
    return timeSourceCheck(status);
  };
  constexpr auto kSource = "told by a host (usb), within 2.1 s";
  const auto told = check("2026-11-30T12:00:00Z", kSource);
  EXPECT_EQ(told.verdict, Verdict::passed);
  EXPECT_THAT(told.measured, HasSubstr(kSource));
  EXPECT_EQ(check("unknown, 12 s after start 7", "unknown").verdict, Verdict::failed);
  EXPECT_EQ(check("", "").verdict, Verdict::failed);
}

}  // namespace
}  // namespace probebox::command
