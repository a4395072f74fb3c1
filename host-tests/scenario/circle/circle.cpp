#include "circle.hpp"

#include <algorithm>
#include <cmath>
#include <gtest/gtest.h>
#include <numbers>
#include <random>

#include "firmware/metrology/live/screw_model.hpp"
#include "protocol/units/angle.hpp"

namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
using world::Vector3;
using world::operator+;
using world::operator-;
using world::operator*;
namespace address = modbus::address;

enum : std::uint16_t { kStart = 1, kAccept = 3 };
enum : std::uint16_t {
  kDelayPerAxis = 4,
  kCAxisAlignment = 8,
  kScrewCalibration = 10,
  kSwivelError = 17,
  kToolSetter = 20,
};
constexpr std::uint16_t kTool = 4;
constexpr std::uint16_t kToolRow = 1000 + 16 * (kTool - 1);
constexpr double kHeadAngle = 45 * kDegree;
constexpr double kReach_mm = 15.5;        // datum sphere and stylus' ball
constexpr double kPartReach_mm = 9;       // ball of the part and stylus' ball
constexpr double kStylusLength_mm = 150;  // as in machine.toml
constexpr double kPivot_mm = 60;          // above the gauge line, as the control has it
constexpr std::array kAssumed_mm{330.0, 200.0};
constexpr double kSensor_s = 0.02;  // of the screws: they follow their faces at the speeds of touches

// From the gauge line to the stylus' ball, for a control that takes its pivot to be 60 mm above.
Vector3 nominalTip(double b_rad) {
  constexpr double kArm_mm = kPivot_mm + kStylusLength_mm;
  return {-kArm_mm * std::sin(b_rad), 0, kPivot_mm - kArm_mm * std::cos(b_rad)};
}

// As the tool's drawing has it.
Vector3 nominalOffset() {
  const auto tools = warmingWorld().further_tools;
  const auto& tool = *std::ranges::find(tools, kTool, &board::WorldTool::number);
  return {tool.offset_mm[0], tool.offset_mm[1], -tool.length_mm};
}

// A control without a program for the box: it stands where it is.
class IdleLink : public world::BoxLink {
 public:
  void postMarker(const Marker&) override {}
  std::optional<bool> markerAnswer() override { return std::nullopt; }
  void home(const Vector3&) override {}
  void askProcedureStatus() override {}
  std::optional<world::Prompt> procedureStatus() override {
    constexpr std::uint32_t kNoSuchTool = 9999;
    return world::Prompt{Step{.tool = kNoSuchTool}, 1, RunState::waiting};
  }
};

IdleLink& idle() {
  static IdleLink link;
  return link;
}

// machine.toml of a machine that corrects all of it.
void describe(box::BoxConfig& box) {
  auto& corrections = box.corrections;
  corrections.mask = 0b1011;  // screw, swivel, centreline
  corrections.swivel.fitted = true;
  for (auto& screw : corrections.screws) screw.model.threshold_rpm = metrology::thresholdRpm(2, kSensor_s);
  corrections.angles[1] = {.described = true, .from = corrections::AngleFrom::controller, .reference = {}, .stale = {}};
}

}  // namespace

world::Config hiddenWorld(std::uint64_t seed) {
  world::Config config = warmingWorld();
  std::mt19937_64 random{seed};
  const auto within = [&](double most) { return std::uniform_real_distribution<double>{-most, most}(random); };
  const auto between = [&](double least, double most) {
    return std::uniform_real_distribution<double>{least, most}(random);
  };
  for (double& tau : config.delays.tau_machine_s) tau = between(0.002, 0.009);
  config.delays.tau_probe_s = between(0.0001, 0.001);
  auto& part = config.part_spindle;
  for (const std::size_t i : {0U, 1U}) part.point_mm[i] += within(0.06);  // as far as it was set up by hand
  part.direction = {within(3e-4), within(3e-4), 1};
  auto& spindle = config.probe_spindle;
  spindle.direction = {within(2e-4), within(2e-4), 1};
  auto& head = *config.swivel_head;
  for (const std::size_t i : {0U, 2U}) head.pivot_mm[i] += within(0.04);
  head.direction = {within(2e-4), 1, within(2e-4)};
  const double sd_mm = usualFacts().tool_setter->sd_probe_offset_mm.value();
  // As well as machine.toml states where the stylus hangs.
  std::normal_distribution off{0.0, sd_mm};
  for (double& offset : spindle.stylus_offset_mm) offset += off(random);
  spindle.stylus_length_mm += off(random);
  for (auto& tool : config.further_tools) {
    if (tool.number != kTool) continue;
    for (double& offset : tool.offset_mm) offset += within(0.02);
    tool.length_mm += within(0.05);
    *tool.radius_mm += within(0.02);
  }
  for (double& at : config.tool_setter->centre_mm) at += within(0.03);
  config.drift_rate_hz = 500;  // while a screw turns before it, a reading belongs to where the screw is now
  for (auto& screw : config.screws) {
    screw->warm_um = between(20, 55);
    screw->time_constant_s = between(700, 1200);
    screw->face_um = {between(0.2, 0.5), between(0.05, 0.1)};
    screw->noise_um = 0.02;
    screw->sensor_time_constant_s = kSensor_s;
  }
  return config;
}

Circle::Circle(std::uint64_t seed)
    : config_{hiddenWorld(seed)},
      office_{2U << 20U, stream::TriggerHistory::kKept, config_, seed},
      boot_{office_, folder_.file("results.db")},
      touches_{boot_, office_.scenario(), line_, correction_, {}, seed} {
  office_.scenario().describeBy(describe);
  office_.restartBox(boot_.restored());
  office_.scenario().speakThrough(line_);
  office_.scenario().recorder().keeps_bytes = false;
  boot_.run(5s);
}

unsigned Circle::ask(std::uint16_t what, std::uint32_t of) {
  const auto commit = line_.value(address::request_commit) + 1;
  EXPECT_TRUE(line_.write(address::request_of, {of * 1.0, what * 1.0, commit}));
  boot_.run(200ms);
  EXPECT_EQ(line_.value(address::request_answered), commit);
  return number(address::request_outcome);
}

// requests: registers from 816 on.
void Circle::calibrate(std::uint16_t method, const std::vector<double>& requests) {
  ASSERT_TRUE(line_.write(address::request_method, {method * 1.0, 0}));
  auto of_axis_on = requests;
  of_axis_on.resize(6);
  ASSERT_TRUE(line_.write(816, of_axis_on));
  ASSERT_EQ(ask(kStart, 0), 2U) << "method " << method << ", refusal " << number(address::request_refusal);
  for (int second = 0; second < 1800 && number(address::step_state) < 4; ++second) {
    boot_.run(1s);
    boot_.solve();
  }
  boot_.run(200ms);
  ASSERT_EQ(number(address::step_state), 4U)
      << "method " << method << ", refusal " << number(address::calibration_refusal) << ": "
      << boot_.calibrations().lastRefusal();
  const auto id = number(address::calibration_result);
  ASSERT_EQ(ask(kAccept, id), 2U) << "method " << method << ", refusal " << number(address::request_refusal);
}

Vector3 Circle::triple(std::uint16_t at) {
  const auto next = [&](unsigned offset) { return line_.value(static_cast<std::uint16_t>(at + offset)); };
  return {next(0), next(2), next(4)};
}

const metrology::Result& Circle::lastResult() {
  const auto record = boot_.calibrations().find(number(address::calibration_result));
  if (record && record->result() != nullptr) last_ = *record->result();
  return last_;
}

void Circle::errorsOfMachine() {
  calibrate(kDelayPerAxis);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    calibrate(kScrewCalibration, {static_cast<double>(axis + 1)});
    const auto* table = lastResult().find("sector_table_um");
    ASSERT_NE(table, nullptr);
    sd_of_extension_mm_[axis] = 1e-3 * std::hypot(std::ranges::max(table->sd), config_.screws[axis]->noise_um);
  }
  calibrate(kCAxisAlignment);
  calibrate(kToolSetter, {0, 0, kTool * 1.0});
  calibrate(kSwivelError);
  const auto* error = lastResult().find("error_at_queries_mm");
  ASSERT_NE(error, nullptr);
  // At 45 degrees with the shorter of the two tools, which is the first.
  for (std::size_t i = 0; i < 3; ++i) sd_of_swivel_mm_[i] = error->sd[i];
}

// Where the turning axis is, less where the control assumes it: what the box adds for it at this height.
Vector3 Circle::centrelineAdds(double z_mm) {
  if (!correction_.adds()) return {};
  touches_.settle();
  Vector3 adds{};
  const double from_now_mm = z_mm - office_.scenario().machine().commandedPosition()[2];
  for (std::size_t i = 0; i < 2; ++i) {
    const auto at = static_cast<std::uint16_t>(2 * i);
    adds[i] = line_.value(static_cast<std::uint16_t>(address::centreline_here + at)) +
              from_now_mm * line_.value(static_cast<std::uint16_t>(address::centreline_slope + at)) - kAssumed_mm[i];
  }
  return adds;
}

double Circle::sdOfCentreline(std::size_t axis, double z_mm) {
  const auto at = static_cast<std::uint16_t>(2 * axis);
  const double slope = line_.value(static_cast<std::uint16_t>(address::centreline_slope_sd + at));
  return std::hypot(line_.value(static_cast<std::uint16_t>(address::centreline_sd + at)),
                    slope * (z_mm - line_.value(address::centreline_z)));
}

double Circle::sdOfScrew(std::size_t axis, double position_mm) const {
  const auto& screw = *config_.machine.screws[axis];
  return std::abs(position_mm + (screw.reversed ? -1 : 1) * screw.offset_mm) / screw.length_mm *
         sd_of_extension_mm_[axis];
}

// Where the head stopped when it was levelled after the calibration of its errors, at the tip of a tool.
double Circle::sdOfLevel(std::size_t axis, double length_mm) const {
  return axis == 0 ? (kPivot_mm + length_mm) * config_.swivel_head->noise_rad : 0;
}

// The mean of both readings, A at 0 and 180 degrees, without the place of the stylus in the spindle.
Vector3 Circle::turnedOut(const OwnTouches::Ball& ball, const world::Pose& pose) {
  auto opposite = pose;
  opposite.a_rad = std::numbers::pi;
  touches_.stand(pose);
  const Vector3 one = touches_.centreOf(ball);
  touches_.stand(opposite);
  return 0.5 * (one + touches_.centreOf(ball));
}

// A ball of the part, half a turn of C apart: its middle is where the control takes the turning axis to be.
void Circle::partAgain() {
  const auto ball = [&](double sense) {
    const auto& at = config_.part_spindle.balls_mm[0];
    return OwnTouches::Ball{
        {kAssumed_mm[0] + sense * at[0], kAssumed_mm[1] + sense * at[1], config_.part_spindle.point_mm[2] + at[2]},
        kPartReach_mm};
  };
  const Vector3 one = turnedOut(ball(1), {}), other = turnedOut(ball(-1), {.c_rad = std::numbers::pi});
  const Vector3 middle = 0.5 * (one + other);
  const double arm_mm = config_.part_spindle.balls_mm[0][0];
  for (std::size_t i = 0; i < 2; ++i) {
    // The ball stands along X: where C stops moves it along Y.
    const double stops_mm = i == 1 ? arm_mm * config_.rotary.noise_rad / std::sqrt(2.0) : 0;
    const double again = std::hypot(touches_.sdAcross() / 2, stops_mm, sdOfLevel(i, kStylusLength_mm));
    const double sd = std::hypot(sdOfCentreline(i, one[2]), sdOfScrew(i, middle[i]), again);
    add("centreline", middle[i] - kAssumed_mm[i], sd);
  }
}

// The datum sphere stands where it stood on the cold machine.
void Circle::sphereAgain() {
  const auto& sphere_mm = config_.sphere.centre_mm;
  const Vector3 shift = centrelineAdds(sphere_mm[2]);
  const Vector3 found = turnedOut({sphere_mm - shift, kReach_mm}, {}) + shift;
  // What half a turn of A leaves: the lean of the spindle over the length of the stylus.
  const auto& machine = office_.scenario().machine();
  const Vector3 hangs = 0.5 * (machine.tipIn({}, 1) + machine.tipIn({.a_rad = std::numbers::pi}, 1));
  for (std::size_t i = 0; i < 3; ++i) {
    const double again = i == 2 ? touches_.sdAlong() / std::sqrt(2.0) : touches_.sdAcross() / std::sqrt(2.0);
    const double sd = std::hypot(sdOfScrew(i, sphere_mm[i]), again, sdOfLevel(i, kStylusLength_mm));
    add("screw", found[i] + hangs[i] - sphere_mm[i], sd);
  }
}

// With the head swivelled and its nominal kinematics, the control finds the sphere where it finds it with the head
// level.
void Circle::headAgain() {
  const auto found = [&](double b_rad) {
    const Vector3 swung = nominalTip(b_rad) - nominalTip(0);
    const Vector3 place = config_.sphere.centre_mm - swung;
    const Vector3 shift = centrelineAdds(place[2]);
    return turnedOut({place - shift, kReach_mm}, {.head_rad = b_rad}) + shift + swung;
  };
  const Vector3 level = found(0), swivelled = found(kHeadAngle);
  const Vector3 from = config_.sphere.centre_mm, to = from - (nominalTip(kHeadAngle) - nominalTip(0));
  for (std::size_t i = 0; i < 3; ++i) {
    const double touched = i == 2 ? touches_.sdAlong() : touches_.sdAcross();  // twice, the mean of two each
    const double swung = i == 1 ? 0 : sdOfLevel(0, kStylusLength_mm) / std::numbers::sqrt2;
    const double stops = std::hypot(sdOfLevel(i, kStylusLength_mm), swung);
    const double screw = sd_of_extension_mm_[i] * std::abs(to[i] - from[i]) / config_.machine.screws[i]->length_mm;
    add("swivel", swivelled[i] - level[i], std::hypot(std::hypot(sd_of_swivel_mm_[i], touched), stops, screw));
  }
}

// The tool's tip, by the offset that the control took into its table, meets the faces of the setting device.
void Circle::toolAgain() {
  const auto& setter = *config_.tool_setter;
  const Vector3 offset = correction_.adds() ? triple(kToolRow) : nominalOffset();
  const Vector3 gauge = setter.centre_mm - Vector3{0, 0, config_.probe_spindle.stylus_length_mm};
  const Vector3 shift = centrelineAdds(gauge[2] - offset[2]);
  const double around_mm = setter.half_width_mm[0] + 5;
  touches_.stand({}, kTool);
  const Vector3 found =
      touches_.centreOf(OwnTouches::Block{gauge - offset - shift, {around_mm, around_mm, setter.half_width_mm[2]}}) +
      shift + offset;
  for (std::size_t i = 0; i < 3; ++i) {
    const double sd_mm = 1e-3 * line_.value(static_cast<std::uint16_t>(kToolRow + 12 + i));
    const double touched = i == 2 ? touches_.sdAlong() : touches_.sdAcross();
    const double again = std::hypot(touched, sdOfLevel(i, -offset[2]));
    add("tool", found[i] - gauge[i], std::hypot(sd_mm, again, sdOfScrew(i, setter.centre_mm[i])));
  }
}

std::vector<Residual> Circle::withOwnTouches() {
  residuals_.clear();
  partAgain();
  sphereAgain();
  headAgain();
  toolAgain();
  return residuals_;
}

void Circle::calibrateAll() {
  errorsOfMachine();
  if (testing::Test::HasFatalFailure()) return;
  touches_.standHere();
  for (int second = 0; second < 120 && number(address::settled) != 1; ++second) boot_.run(1s);
  EXPECT_EQ(number(address::status) & published::kValid, unsigned{published::kValid})
      << number(address::sources_invalid);
}

std::vector<Residual> Circle::delayAgain() {
  residuals_.clear();
  const Vector3 first_ms = triple(address::delay_f32), sd_first_ms = triple(address::delay_sd_f32);
  calibrate(kDelayPerAxis);
  const Vector3 again_ms = triple(address::delay_f32), sd_ms = triple(address::delay_sd_f32);
  for (std::size_t i = 0; i < 3; ++i) add("delay", again_ms[i] - first_ms[i], std::hypot(sd_first_ms[i], sd_ms[i]));
  return residuals_;
}

std::vector<Residual> Circle::corrected() {
  boot_.run(20s);
  office_.scenario().speakThrough(idle());
  boot_.run(1s);
  return withOwnTouches();
}

std::vector<Residual> Circle::uncorrected() {
  correction_.addNothing();
  return withOwnTouches();
}

}  // namespace probebox::scenario
