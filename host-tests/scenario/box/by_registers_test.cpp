#include <algorithm>
#include <cmath>
#include <gmock/gmock.h>

#include "firmware/json/dataset_json.hpp"
#include "host-tests/emulation/line_of_the_box.hpp"
#include "host-tests/support/temporary_folder.hpp"

// A controller that knows nothing but registers runs calibrations, accepts them, and the corrections follow.
namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
namespace address = modbus::address;

enum : std::uint16_t { kStart = 1, kAbort = 2, kAccept = 3 };
enum : std::uint16_t {
  kDelayMultiSpeed = 1,
  kCentreline = 7,
  kSpindleOffset2x2 = 11,
  kToolSetter = 20,
  kCentrelineBySteps = 23,
  kDelaySteppedScan = 26,
  kDelayContour = 27
};

// A line at whose end nobody is.
class DeadLink : public world::BoxLink {
 public:
  void postMarker(const Marker&) override {}
  std::optional<bool> markerAnswer() override { return std::nullopt; }
  void home(const world::Vector3&) override {}
  void askProcedureStatus() override {}
  std::optional<world::Prompt> procedureStatus() override { return std::nullopt; }
};

class ByRegisters : public testing::Test {
 protected:
  explicit ByRegisters(const procedure::Facts& facts = usualFacts())
      : boot_{office_, folder_.file("results.db"), facts} {
    for (const auto& event : boot_.restored()) office_.scenario().push(event);
    office_.scenario().speakThrough(controller_);
    boot_.run(5s);
  }

  // Makes a request and returns its outcome: 2 done, 3 refused.
  unsigned ask(std::uint16_t what, std::uint32_t of = 0) {
    const auto commit = controller_.value(address::request_commit) + 1;
    EXPECT_TRUE(controller_.write(address::request_of, {of * 1.0, what * 1.0, commit}));
    boot_.run(200ms);
    EXPECT_EQ(controller_.value(address::request_answered), commit);
    return number(address::request_outcome);
  }
  unsigned start(std::uint16_t method) {
    EXPECT_TRUE(controller_.write(address::request_method, {method * 1.0, 0}));
    return ask(kStart);
  }
  unsigned number(std::uint16_t at) { return static_cast<unsigned>(controller_.value(at)); }
  // Waits for the end of a run; the number of its result, 0 when there is none.
  unsigned result() {
    for (int second = 0; second < 900; ++second) {
      boot_.run(1s);
      boot_.solve();
      const auto state = number(address::step_state);
      if (state >= 4) break;
    }
    boot_.run(200ms);
    EXPECT_EQ(number(address::step_state), 4U) << "proposed; refusal " << number(address::calibration_refusal);
    return number(address::calibration_result);
  }
  void calibrate(std::uint16_t method) {
    ASSERT_EQ(start(method), 2U) << "refusal " << number(address::request_refusal);
    const auto id = result();
    ASSERT_NE(id, 0U);
    EXPECT_EQ(number(address::calibration_state), 2U);
    ASSERT_EQ(ask(kAccept, id), 2U) << "refusal " << number(address::request_refusal);
    EXPECT_EQ(number(address::calibration_state), 3U) << "in force, and said so";
  }

  const support::TemporaryFolder folder_;
  Office office_;
  Boot boot_;
  LineOfTheBox line_{office_, boot_};
  RegisterLink controller_{line_.registers()};
};

TEST_F(ByRegisters, AWholeCalibrationIsRunAcceptedAndFollowed) {
  calibrate(kDelayMultiSpeed);
  EXPECT_EQ(number(address::status) & published::kDelayCalibrated, unsigned{published::kDelayCalibrated});
  const double tau_ms = controller_.value(address::delay_f32), sd_ms = controller_.value(address::delay_sd_f32);
  EXPECT_GT(sd_ms, 0);
  EXPECT_NEAR(tau_ms, 1e3 * office_.scenario().truth().tau_s[0], 5 * sd_ms);

  // Both axes, then the centreline from the tip: the box adds the stylus' offset.
  calibrate(kSpindleOffset2x2);
  EXPECT_EQ(number(412), controller_.value(412)) << "its number is shown";
  EXPECT_EQ(number(415) & 1U, 1U) << "in force";
  EXPECT_NE(controller_.value(400), 0) << "C less A along X";
  const auto stylus = boot_.newestProposed();
  ASSERT_TRUE(stylus) << "the offset of the stylus, from the same readings";
  ASSERT_EQ(ask(kAccept, static_cast<std::uint32_t>(stylus->id)), 2U);
  EXPECT_EQ(number(5015) & 1U, 1U) << "stylus 1 is in force";
  calibrate(kCentreline);
  EXPECT_EQ(number(address::status) & published::kCentrelineCalibrated, unsigned{published::kCentrelineCalibrated});
  office_.scenario().push(SourcesEnabled{.mask = 8, .at = office_.scenario().now()});
  boot_.run(20s);
  EXPECT_EQ(number(address::status) & published::kValid, unsigned{published::kValid});
  const auto& assumed = office_.scenario().box().state().snapshot.centreline;
  ASSERT_TRUE(assumed.has_z);
  EXPECT_NE(controller_.value(address::correction_f32), 0) << "the correction follows the turning axis";
}

// 66 um off, and stated to half a micrometre.
procedure::Facts withAStaleOffset() {
  auto facts = usualFacts();
  facts.tool_setter->probe_offset_mm[0] += 0.066;
  return facts;
}

class WithAStaleOffset : public ByRegisters {
 protected:
  WithAStaleOffset() : ByRegisters{withAStaleOffset()} {}
};

TEST_F(WithAStaleOffset, AToolIsSetByTheMeasuredOffsetOfTheStylus) {
  calibrate(kDelayMultiSpeed);
  calibrate(kSpindleOffset2x2);
  const auto stylus = boot_.newestProposed();
  ASSERT_TRUE(stylus);
  ASSERT_EQ(ask(kAccept, static_cast<std::uint32_t>(stylus->id)), 2U);
  EXPECT_TRUE(controller_.write(address::request_tool, {4}));
  calibrate(kToolSetter);
  const auto set = boot_.calibrations().find(number(address::calibration_result));
  ASSERT_TRUE(set && set->result() != nullptr);
  const auto dataset = json::datasetFromJson(boot_.calibrations().datasetOf(set->id).value());
  ASSERT_TRUE(dataset);
  const auto used = std::get<std::vector<double>>(dataset->config.at("probe_offset_mm"));
  EXPECT_EQ(used[0], stylus->result()->find("stylus_offset_mm")->values[0]);
  EXPECT_EQ(std::get<double>(dataset->config.at("stylus_offset_result")), static_cast<double>(stylus->id));
  const auto warned = [&](const char* name) {
    return std::ranges::any_of(set->result()->warnings,
                               [&](const std::string& warning) { return warning.starts_with(name); });
  };
  EXPECT_TRUE(warned("places-disagree: stylus-offset-1 X"));
  EXPECT_TRUE(warned("spindle-tilt-unknown"));
  EXPECT_FALSE(warned("places-disagree: check")) << "another place";
  EXPECT_FALSE(boot_.calibrations().placesThatDisagree().empty());
}

// Radii, arcs, ramps and sense of a scan are all in registers.
TEST_F(ByRegisters, ScansAreDoneAcceptedAndFollowed) {
  for (const std::uint16_t method : {kDelaySteppedScan, kDelayContour}) {
    calibrate(method);
    const double tau_ms = controller_.value(address::delay_f32), sd_ms = controller_.value(address::delay_sd_f32);
    EXPECT_GT(sd_ms, 0);
    EXPECT_EQ(controller_.value(address::delay_sd_f32 + 4), 0) << "a scan at one height tells nothing of Z";
    EXPECT_EQ(number(address::status) & published::kDelayCalibrated, 0U) << "so not every axis has its delay";
    EXPECT_NEAR(tau_ms, 1e3 * office_.scenario().truth().tau_s[0], 5 * sd_ms);
    EXPECT_EQ(number(address::step_scan_arcs), 0U) << "no step is to be done any more";
  }
}

// So are the angles and the speed of C of a turn until contact.
TEST_F(ByRegisters, TurnsUntilContactAreDoneAndAccepted) {
  calibrate(kDelayMultiSpeed);
  EXPECT_TRUE(controller_.write(address::request_contacts, {1}));
  calibrate(kCentrelineBySteps);
  const auto result = boot_.calibrations().find(number(address::calibration_result));
  ASSERT_TRUE(result && result->result() != nullptr);
  EXPECT_NE(result->result()->find("contact_shift_rad"), nullptr);
  EXPECT_EQ(office_.scenario().machine().crashes(), 0U);
  EXPECT_EQ(controller_.value(address::step_turn_to), 0) << "no step is to be done any more";
}

TEST_F(ByRegisters, ARequestIsDoneOnceHoweverOftenItIsWritten) {
  ASSERT_EQ(start(kDelayMultiSpeed), 2U);
  const auto run = number(address::request_number);
  const auto commit = controller_.value(address::request_commit);
  EXPECT_EQ(number(address::step_run), run);
  EXPECT_TRUE(controller_.write(address::request_of, {0, 1, commit}));
  boot_.run(1s);
  EXPECT_EQ(number(address::request_number), run);
  EXPECT_EQ(number(address::request_outcome), 2U);
  EXPECT_EQ(start(kDelayMultiSpeed), 3U) << "another request: the run is in progress";
  EXPECT_EQ(number(address::request_refusal), 4U) << "busy";
  EXPECT_EQ(ask(kAbort, run), 2U);
  EXPECT_EQ(number(address::step_state), 6U);
}

TEST_F(ByRegisters, RefusalsHaveTheirCode) {
  EXPECT_EQ(start(999), 3U);
  EXPECT_EQ(number(address::request_refusal), 5U) << "no such method";
  EXPECT_EQ(start(kCentreline), 3U);
  EXPECT_EQ(number(address::request_refusal), 7U) << "no delay is in force";
  EXPECT_EQ(ask(kAccept, 12345), 3U);
  EXPECT_NE(number(address::request_refusal), 0U);
  EXPECT_EQ(ask(kAbort), 3U) << "no run is in progress";
}

// A controller that dies in mid-step: the next one reads where the run is, gives the step up and goes on.
TEST_F(ByRegisters, AMasterThatDiesInMidStepLeavesARunThatGoesOn) {
  ASSERT_EQ(start(kDelayMultiSpeed), 2U);
  ASSERT_TRUE(office_.scenario().runUntil(
      [this] { return number(address::step_state) == 2 && number(address::step_number) >= 3; }, 60s));
  // All that it had written is gone with it, and the next one begins with other numbers.
  DeadLink dead;
  office_.scenario().speakThrough(dead);
  boot_.run(15s);
  EXPECT_LE(number(address::step_state), 2U) << "the run waits";
  line_.restart();
  RegisterLink next{line_.registers()};
  office_.scenario().speakThrough(next);
  const auto id = result();
  EXPECT_NE(id, 0U);
}

}  // namespace
}  // namespace probebox::scenario
