#include "firmware/modbus/writable_registers.hpp"

#include <gmock/gmock.h>
#include <numbers>
#include <rapidcheck/gtest.h>

namespace probebox::modbus {
namespace {

using Words = std::vector<std::uint16_t>;

Words shownBy(const WritableRegisters& registers) {
  std::array<std::uint16_t, kRegisterCount> image{};
  registers.show(image);
  return {image.begin(), image.end()};
}

ExceptionCode refusalOf(WritableRegisters registers, std::uint16_t first, const Words& values) {
  const auto before = shownBy(registers);
  const auto outcome = registers.write(first, values);
  EXPECT_FALSE(outcome.ok());
  EXPECT_EQ(shownBy(registers), before) << "a refused write changes nothing";
  return outcome.ok() ? ExceptionCode{} : outcome.error().code;
}

TEST(WritableRegisters, MakeAMarkerOfWhatWasWrittenBeforeTheCommit) {
  WritableRegisters registers;
  ASSERT_TRUE(registers.write(144, Words{1, 2, 9, 2, 305, 4}).ok());
  // -90 degrees, 0, 360
  ASSERT_TRUE(registers.write(150, Words{0xFFFE, 0xA070, 0, 0, 5, 32320}).ok());
  const auto committed = registers.write(157, Words{1});
  ASSERT_TRUE(committed.ok() && committed->size() == 1);
  const auto& marker = std::get<Marker>(committed->front());
  EXPECT_EQ(marker.procedure, 65538U);
  EXPECT_EQ(marker.step, 9U);
  EXPECT_EQ(marker.phase, MarkerPhase::abandon);
  EXPECT_NEAR(marker.nominal_speed_mm_s, 30.5, 1e-9);
  EXPECT_EQ(marker.tool, 4U);
  EXPECT_NEAR(marker.rotary_angles_rad[0], -std::numbers::pi / 2, 1e-12);
  EXPECT_NEAR(marker.rotary_angles_rad[2], 2 * std::numbers::pi, 1e-12);
  EXPECT_FALSE(marker.at_rest);
}

TEST(WritableRegisters, CommitOncePerNumber) {
  WritableRegisters registers;
  const auto commits = [&](std::uint16_t number) { return !registers.write(157, Words{number}).value().empty(); };
  EXPECT_TRUE(commits(5));
  EXPECT_FALSE(commits(5));
  EXPECT_TRUE(commits(6));
  EXPECT_TRUE(commits(5));
  EXPECT_EQ(refusalOf(registers, 157, {0}), ExceptionCode::illegal_value);
}

TEST(WritableRegisters, RefuseByName) {
  const WritableRegisters registers;
  EXPECT_EQ(refusalOf(registers, 5, {1}), ExceptionCode::illegal_address);
  EXPECT_EQ(refusalOf(registers, 129, {1}), ExceptionCode::illegal_address);
  EXPECT_EQ(refusalOf(registers, 157, {1, 1}), ExceptionCode::illegal_address)
      << "runs past the last writable register";
  EXPECT_EQ(refusalOf(registers, 65535, {1, 1}), ExceptionCode::illegal_address);
  EXPECT_EQ(refusalOf(registers, 128, {2}), ExceptionCode::illegal_value);
  EXPECT_EQ(refusalOf(registers, 146, {1, 4}), ExceptionCode::illegal_value);
  EXPECT_EQ(refusalOf(registers, 156, {2}), ExceptionCode::illegal_value);
}

TEST(WritableRegisters, RefuseToCommitAnAngleBeyondTenTurns) {
  WritableRegisters registers;
  ASSERT_TRUE(registers.write(150, Words{0x7FFF}).ok()) << "half of a value may be anything";
  EXPECT_EQ(refusalOf(registers, 157, {1}), ExceptionCode::illegal_value);
  ASSERT_TRUE(registers.write(242, Words{0x7FFF}).ok());
  ASSERT_TRUE(registers.write(246, Words{2}).ok());
  EXPECT_EQ(refusalOf(registers, 250, {1}), ExceptionCode::illegal_value);
  ASSERT_TRUE(registers.write(246, Words{4}).ok());
  EXPECT_TRUE(registers.write(250, Words{1}).ok()) << "of C alone";
}

// 32-bit values that come in one write are looked at at once.
TEST(WritableRegisters, RefuseAValueOutOfItsRangeWhenItIsWritten) {
  const WritableRegisters registers;
  for (const std::uint16_t angle : std::array<std::uint16_t, 6>{150, 152, 154, 240, 242, 244})
    EXPECT_EQ(refusalOf(registers, angle, {0x7FFF, 0xFFFF}), ExceptionCode::illegal_value) << angle;
  EXPECT_EQ(refusalOf(registers, 248, {0xFFFF, 0xFFFF}), ExceptionCode::illegal_value) << "a length below 0";
  EXPECT_EQ(refusalOf(registers, 248, {0x7FFF, 0xFFFF}), ExceptionCode::illegal_value);
}

TEST(WritableRegisters, MakeARequestOfWhatWasWrittenBeforeItsCommit) {
  WritableRegisters registers;
  // delay-multi-speed at 5 and 20 mm/s, 0.5 mm of overtravel
  ASSERT_TRUE(registers.write(800, Words{1, 2, 50, 200}).ok());
  ASSERT_TRUE(registers.write(810, Words{500}).ok());
  EXPECT_EQ(registers.controllerRequest().commit, 0);
  ASSERT_TRUE(registers.write(834, Words{0, 0, 1, 7}).ok());
  const auto controller_request = registers.controllerRequest();
  EXPECT_EQ(controller_request.commit, 7);
  EXPECT_EQ(controller_request.what, ControllerRequest::What::start);
  EXPECT_EQ(controller_request.method, 1);
  EXPECT_EQ(controller_request.options.speed_count, 2);
  EXPECT_DOUBLE_EQ(controller_request.options.speeds_mm_s[1], 20.0);
  EXPECT_DOUBLE_EQ(controller_request.options.overtravel_mm, 0.5);
  EXPECT_EQ(controller_request.options.clearance_mm, 0) << "the method's own";
}

TEST(WritableRegisters, RefuseARequestThatIsNone) {
  WritableRegisters registers;
  EXPECT_EQ(refusalOf(registers, 837, {1}), ExceptionCode::illegal_value) << "it says not what";
  ASSERT_TRUE(registers.write(836, Words{3}).ok());
  ASSERT_TRUE(registers.write(837, Words{1}).ok());
  EXPECT_EQ(refusalOf(registers, 837, {0}), ExceptionCode::illegal_value);
  EXPECT_EQ(refusalOf(registers, 836, {9, 2}), ExceptionCode::illegal_value);
  EXPECT_EQ(refusalOf(registers, 838, {1}), ExceptionCode::illegal_address) << "the answer is the box's";
}

TEST(WritableRegisters, ReferenceTheAxesThatWereHomed) {
  WritableRegisters registers;
  EXPECT_EQ(refusalOf(registers, 137, {1}), ExceptionCode::illegal_value) << "no axis was named";
  EXPECT_EQ(refusalOf(registers, 136, {8}), ExceptionCode::illegal_value);
  // X at 12.5 mm, Z at -0.25 mm, in one request.
  const auto committed = registers.write(130, Words{0x0001, 0xE848, 0, 0, 0xFFFF, 0xF63C, 0b101, 1});
  ASSERT_TRUE(committed.ok());
  ASSERT_EQ(committed->size(), 2U);
  const auto& x = std::get<AxisHomed>((*committed)[0]);
  const auto& z = std::get<AxisHomed>((*committed)[1]);
  EXPECT_EQ(x.axis, Axis::x);
  EXPECT_NEAR(x.position_mm, 12.5, 1e-9);
  EXPECT_EQ(z.axis, Axis::z);
  EXPECT_NEAR(z.position_mm, -0.25, 1e-9);
  EXPECT_TRUE(registers.write(137, Words{1})->empty()) << "the same number again does nothing";
}

TEST(WritableRegisters, TellAPoseOncePerCommit) {
  WritableRegisters registers;
  EXPECT_EQ(refusalOf(registers, 250, {1}), ExceptionCode::illegal_value) << "it tells nothing";
  EXPECT_EQ(refusalOf(registers, 246, {16}), ExceptionCode::illegal_value);
  // B at -30 degrees, tool 4, 120.5 mm long, in one request.
  const Words pose{0, 0, 0xFFFB, 0x6C20, 0, 0, 0b1010, 4, 0x0012, 0x6308, 7};
  const auto committed = registers.write(240, pose);
  ASSERT_TRUE(committed.ok() && committed->size() == 1);
  const auto& told = std::get<PoseTold>(committed->front());
  EXPECT_EQ(told.axes, 0b010);
  EXPECT_NEAR(told.angles_rad[1], -std::numbers::pi / 6, 1e-12);
  EXPECT_TRUE(told.has_tool);
  EXPECT_EQ(told.tool, 4U);
  EXPECT_NEAR(told.tool_length_mm, 120.5, 1e-9);
  EXPECT_TRUE(registers.write(250, Words{7})->empty()) << "the same number again does nothing";
  ASSERT_TRUE(registers.write(248, Words{0xFFFF}).ok());
  EXPECT_EQ(refusalOf(registers, 250, {8}), ExceptionCode::illegal_value) << "a length below zero";
}

TEST(WritableRegisters, TellWhenACutBeginsAndEnds) {
  WritableRegisters registers;
  const auto asked = [&](std::uint16_t value) { return registers.write(138, Words{value}).value(); };
  for (const std::uint16_t value : Words{1, 1, 0, 0}) {
    const auto said = asked(value);
    ASSERT_EQ(said.size(), 1U) << "a repeated one may not be on the disk yet";
    EXPECT_EQ(std::get<CutInhibit>(said.front()).active, value == 1);
  }
  EXPECT_EQ(refusalOf(registers, 138, {2}), ExceptionCode::illegal_value);
  EXPECT_TRUE(registers.write(136, Words{0}).value().empty()) << "not of register 138";
}

TEST(WritableRegisters, RefuseARequestThatNoRunCouldHaveAtOnce) {
  WritableRegisters registers;
  EXPECT_EQ(refusalOf(registers, address::request_speeds, {9}), ExceptionCode::illegal_value);
  EXPECT_EQ(refusalOf(registers, address::request_speeds, {255}), ExceptionCode::illegal_value);
  EXPECT_EQ(refusalOf(registers, address::request_read_by, {3}), ExceptionCode::illegal_value);
  EXPECT_EQ(refusalOf(registers, address::request_axis, {7}), ExceptionCode::illegal_value);
  EXPECT_EQ(refusalOf(registers, address::request_mounts, {256}), ExceptionCode::illegal_value);
  EXPECT_EQ(registers.controllerRequest().options.speed_count, 0);
  EXPECT_TRUE(registers.write(address::request_speeds, Words{8}).ok());
  EXPECT_EQ(registers.controllerRequest().options.speed_count, 8);
}

RC_GTEST_PROP(WritableRegisters, ShowWhatWasTakenAndNothingElse, (std::uint16_t first, Words values)) {
  WritableRegisters registers;
  const auto from = static_cast<std::uint16_t>(first % 2 == 0 ? first % 260 : 800 + first % 40);
  const auto before = shownBy(registers);
  const auto outcome = registers.write(from, values);
  RC_ASSERT(registers.controllerRequest().options.speed_count <= kMostSpeeds);
  const auto after = shownBy(registers);
  for (std::size_t i = 0; i < after.size(); ++i) {
    const bool written = outcome.ok() && i >= from && i < from + values.size();
    RC_ASSERT(after[i] == (written ? values[i - from] : before[i]));
  }
}

}  // namespace
}  // namespace probebox::modbus
