#include <cmath>
#include <gmock/gmock.h>
#include <numbers>

#include "firmware/modbus/identification.hpp"
#include "firmware/modbus/register_image.hpp"
#include "protocol/modbus/result_blocks.hpp"

namespace probebox::modbus {
namespace {

using published::LineState;
using published::ServedResult;
using published::ServedResults;

RegisterImage::Results inForce(std::vector<ServedResult> results) {
  return std::make_shared<ServedResults>(ServedResults{std::move(results)});
}
double valueAt(const RegisterImage& image, std::uint16_t address, WordOrder order = WordOrder::high_first) {
  const auto& entry = *find(address);
  std::array<std::uint16_t, kRegisterCount> words{};
  for (std::size_t i = 0; i < registersOf(entry.kind); ++i)
    words[entry.address + i] = image[static_cast<std::uint16_t>(address + i)];
  return decode(entry, order, words);
}

TEST(ResultImage, ShowsATurningAxisFromTheTipBesideTheCentreline) {
  RegisterImage image;
  const auto results = inForce({{.subject = "centreline-stylus",
                                 .result_id = 41,
                                 .probe_tool = 7,
                                 .rests_on_retired = false,
                                 .values = {{"centre_mm", {12.25, -3.5}, {0.001, 0.002}}}}});
  image.fill({}, LineState{}, results, WordOrder::high_first);
  EXPECT_DOUBLE_EQ(valueAt(image, 180), 12.25);
  EXPECT_DOUBLE_EQ(valueAt(image, 182), -3.5);
  EXPECT_NEAR(valueAt(image, 184), 0.001, 1e-9);
  EXPECT_EQ(valueAt(image, 188), 41);
  EXPECT_EQ(image[190], 7) << "the probe's number";
  EXPECT_EQ(image[191], kInForce | 16 | 32);
  image.fill({}, LineState{}, inForce({}), WordOrder::high_first);
  for (std::uint16_t at = 180; at < 192; ++at) EXPECT_EQ(image[at], 0) << "rolled back: " << at;
}

TEST(ResultImage, ShowsAProposedCheckApartFromTheOneInForce) {
  const auto check = [](std::uint64_t id, double verdict) {
    return ServedResult{.subject = "check", .result_id = id, .values = {{"verdict", {verdict}, {}}}};
  };
  RegisterImage image;
  image.fill({}, LineState{}, std::make_shared<ServedResults>(ServedResults{{check(5, 0)}, {check(9, 2)}}),
             WordOrder::high_first);
  EXPECT_EQ(valueAt(image, 568), 0);
  EXPECT_EQ(valueAt(image, 576), 5);
  EXPECT_EQ(valueAt(image, 980), 2);
  EXPECT_EQ(valueAt(image, 988), 9);
  EXPECT_EQ(image[991], kInForce | 16);
  image.fill({}, LineState{}, inForce({check(9, 2)}), WordOrder::high_first);
  for (std::uint16_t at = 980; at < 992; ++at) EXPECT_EQ(image[at], 0) << "accepted: " << at;
}

TEST(ResultImage, ShowsAPivotByTheCoordinatesOfItsPlane) {
  RegisterImage image;
  image.fill({}, LineState{},
             inForce({{.subject = "head-pivot",
                       .result_id = 3,
                       .probe_tool = 1,
                       .rests_on_retired = true,
                       .values = {{"pivot_xz_mm", {1.5, 150.25}, {0.01, 0.02}}, {"along_mm", {5}, {}}}}}),
             WordOrder::high_first);
  EXPECT_DOUBLE_EQ(valueAt(image, 432), 1.5);
  EXPECT_DOUBLE_EQ(valueAt(image, 434), 0) << "Y is not in its plane";
  EXPECT_DOUBLE_EQ(valueAt(image, 436), 150.25);
  const unsigned state = image[471];
  EXPECT_EQ(state & 3U, kInForce | kRestsOnRetired);
  EXPECT_EQ(state >> kFirstKnownBit, 0b1000101U) << "X, Z and the place along the axis";
}

TEST(ResultImage, ShowsThePreTravelOfATouchTriggerProbe) {
  RegisterImage image;
  const ServedResult measured{
      .subject = "pre-travel",
      .result_id = 11,
      .probe_tool = 2,
      .rests_on_retired = false,
      .values = {{"pre_travel_mm", {0.01, 0.002, -0.001, 0.004}, {0.0001, 0.0002, 0.0003, 0.0004}}}};
  image.fill({}, LineState{}, inForce({measured}), WordOrder::high_first);
  for (std::uint16_t part = 0; part < 4; ++part) {
    const auto of_part = static_cast<std::uint16_t>(2 * part);
    const double value_mm = measured.values[0].values[part];
    EXPECT_NEAR(valueAt(image, 944 + of_part), value_mm, 1e-8);
    EXPECT_NEAR(valueAt(image, 952 + of_part), measured.values[0].sd[part], 1e-9);
    EXPECT_EQ(valueAt(image, 960 + of_part), std::round(value_mm * 1e6)) << "nm";
  }
  EXPECT_EQ(valueAt(image, 968), 11);
  EXPECT_EQ(image[970], 2) << "the probe's number";
  EXPECT_EQ(image[971], kInForce | 0xF0U);
}

TEST(ResultImage, HasATableOfToolsThatOneRequestReadsARowOf) {
  RegisterImage image;
  const auto results = inForce(
      {{.subject = "tool-12", .result_id = 5, .values = {{"tool_offset_mm", {1.25, 0, -88.5}, {0.0005, 0, 0.001}}}},
       {.subject = "assembly-99",
        .result_id = 6,
        .values = {{"compensation_mm", {0.1, 0.2, 0.3}, {}},
                   {"assembled_length_mm", {88.25}, {0.001}},
                   {"gauge_length_mm", {150.5}, {}}}},
       {.subject = "stylus-offset-1", .result_id = 7, .values = {{"stylus_offset_x_mm", {0.5}, {}}}},
       {.subject = "tool-100", .result_id = 8, .values = {{"tool_offset_mm", {9, 9, 9}, {}}}}});
  for (const auto order : {WordOrder::high_first, WordOrder::low_first}) {
    image.fill({}, LineState{}, results, order);
    const std::uint16_t row = 1000 + 16 * 11;
    EXPECT_DOUBLE_EQ(valueAt(image, row, order), 1.25);
    EXPECT_DOUBLE_EQ(valueAt(image, row + 4, order), -88.5);
    EXPECT_EQ(valueAt(image, row + 10, order), -88'500'000) << "nm";
    EXPECT_EQ(image[row + 12], 50) << "sd, 0.01 um";
    EXPECT_EQ(image[row + 14], 100);
    EXPECT_EQ(image[row + 15], kInForce | 16 | 32 | 64);
    EXPECT_EQ(image[row + 16], 0) << "the next tool was not measured";
    EXPECT_NEAR(valueAt(image, 3000 + 16 * 98, order), 0.3, 1e-7) << "L4";
    const std::uint16_t shown = 7000 + 16 * 98;
    EXPECT_DOUBLE_EQ(valueAt(image, shown, order), 88.25) << "L3";
    EXPECT_DOUBLE_EQ(valueAt(image, shown + 2, order), 150.5) << "gauge length";
    EXPECT_EQ(valueAt(image, shown + 4, order), 88'250'000) << "nm";
    EXPECT_EQ(image[shown + 8], 100) << "sd, 0.01 um";
    EXPECT_EQ(image[shown + 15], kInForce | 16 | 32);
    EXPECT_EQ(image[5015], kInForce | 16) << "X alone";
  }
}

TEST(ResultImage, TellsAChuckOfTheSlideFromATurningAxis) {
  RegisterImage image;
  published::Snapshot snapshot;
  snapshot.centreline.result.result_id = 9;
  image.fill(snapshot, LineState{}, inForce({{.subject = "centreline-slide", .result_id = 9}}), WordOrder::high_first);
  EXPECT_EQ(image[159], 1);
  image.fill(snapshot, LineState{}, inForce({{.subject = "centreline", .result_id = 9}}), WordOrder::high_first);
  EXPECT_EQ(image[159], 0);
}

TEST(ResultImage, SaysAcceptedOfWhateverIsInForce) {
  RegisterImage image;
  published::Snapshot snapshot;
  snapshot.calibration = published::CalibrationState::proposed;
  snapshot.calibration_result_id = 9;
  image.fill(snapshot, LineState{}, inForce({}), WordOrder::high_first);
  EXPECT_EQ(image[96], 2);
  image.fill(snapshot, LineState{}, inForce({{.subject = "setter", .result_id = 9}}), WordOrder::high_first);
  EXPECT_EQ(image[96], 3);
}

TEST(ResultImage, TellsTheStepWithItsTargetAndSide) {
  RegisterImage image;
  published::Snapshot snapshot;
  auto& step = snapshot.step;
  step.present = true;
  step.state = RunState::waiting;
  step.outward_normal = {0, -1, 0};
  step.nominal_speed_mm_s = 15;
  step.rotary_angles_rad = {0, 0, 1.5707963267948966};
  step.turns = true;
  step.fault = 7;
  snapshot.calibration_step = 4;
  LineState line;
  line.boots = 77;
  line.features.sphere_reach_mm = 13.5;
  image.fill(snapshot, line, nullptr, WordOrder::high_first);
  EXPECT_EQ(image[50], 77);
  EXPECT_EQ(image[849], 4);
  EXPECT_EQ(image[854], 4) << "-Y";
  EXPECT_EQ(image[858], 1 | 2 | 16);
  EXPECT_EQ(image[860], 27) << "the pose was another one";
  EXPECT_DOUBLE_EQ(valueAt(image, 898), -13.5);
  EXPECT_NEAR(valueAt(image, 892), 90, 1e-5);
  step.feature = StepFeature::part_ball;  // whose size nobody states
  image.fill(snapshot, line, nullptr, WordOrder::high_first);
  EXPECT_EQ(image[858], 1 | 2);
  EXPECT_DOUBLE_EQ(valueAt(image, 898), 0);
}

TEST(ResultImage, TellsTheWayOfAScan) {
  RegisterImage image;
  published::Snapshot snapshot;
  auto& step = snapshot.step;
  step.present = true;
  step.kind = StepKind::scan;
  step.scan = {.depths_mm = {0.25, 0.5},
               .start_rad = std::numbers::pi / 2,
               .ramp_rad = std::numbers::pi / 18,
               .sense = -1,
               .chords = false,
               .count = 3,
               .arcs_rad = {std::numbers::pi, std::numbers::pi / 4, 0.0, 0.0, 0.0, 0.0, 0.0, std::numbers::pi / 6}};
  LineState line;
  line.features.sphere_reach_mm = 13.5;
  image.fill(snapshot, line, nullptr, WordOrder::high_first);
  const auto value = [&](std::uint16_t at) { return valueAt(image, at); };
  EXPECT_EQ(image[address::step_scan_arcs], 3);
  EXPECT_EQ(image[address::step_scan_bits], 1) << "clockwise";
  EXPECT_NEAR(value(address::step_scan_start), 90, 1e-5);
  EXPECT_NEAR(value(address::step_scan_ramp), 10, 1e-5);
  EXPECT_DOUBLE_EQ(value(address::step_scan_radius), 13.25);
  EXPECT_DOUBLE_EQ(value(address::step_scan_radius + 2), 13.0);
  EXPECT_NEAR(value(address::step_scan_arc), 180, 1e-5);
  EXPECT_NEAR(value(address::step_scan_arc + 2), 45, 1e-5);
  EXPECT_NEAR(value(address::step_scan_arc + 14), 30, 1e-5) << "the last";
}

Request identificationRequest(std::uint8_t kind, std::uint8_t object) {
  Request request;
  request.bytes = {1, 43, 14, kind, object};
  request.size = 7;
  return request;
}

TEST(Identification, NamesVendorProductAndRevision) {
  std::array<std::uint8_t, kMaxFrameBytes> answer{};
  const auto size = identification(identificationRequest(1, 0), "1.2.3", answer);
  ASSERT_GT(size, 10U);
  EXPECT_EQ(crc16(std::span{answer}.first(size)), 0) << "a frame with its CRC has the CRC 0";
  EXPECT_EQ(answer[7], 3) << "objects";
  const std::string text{answer.begin(), answer.begin() + static_cast<std::ptrdiff_t>(size)};
  EXPECT_THAT(text, testing::HasSubstr("probebox"));
  EXPECT_THAT(text, testing::HasSubstr("1.2.3"));
  EXPECT_EQ(identification(identificationRequest(4, 9), "1", answer), 5U);
  EXPECT_EQ(answer[2], 2) << "no such object";
  Request other = identificationRequest(1, 0);
  other.bytes[2] = 13;
  EXPECT_EQ(identification(other, "1", answer), 0U) << "another type: the function is not the box's";
}

}  // namespace
}  // namespace probebox::modbus
