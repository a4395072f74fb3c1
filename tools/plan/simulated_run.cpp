#include "tools/plan/simulated_run.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "firmware/capture/recording.hpp"
#include "firmware/procedure/dataset/run_dataset.hpp"

namespace probebox::plan {
namespace {

using Eigen::Vector3d;
using Random = std::mt19937_64;

constexpr double kCountsPerMm = 1e6;
constexpr double kNanometresPerMm = 1e6;
constexpr double kLead_s = 0.02;   // at rest before and after a touch
constexpr double kStart_s = 1000;  // any: later than all delays

MonoTime at(double t_s) {
  return monoTime(std::llround(t_s * 1e9));
}

Vector3d vector(const std::array<double, 3>& v) {
  return {v[0], v[1], v[2]};
}

// From rest to rest over a distance, through a trapezoid of speed.
class Drive {
 public:
  Drive(double distance, double speed, double acceleration)
      : distance_{distance},
        speed_{std::min(speed, std::sqrt(distance * acceleration))},
        acceleration_{acceleration},
        ramp_{speed_ / acceleration},
        cruise_{distance / speed_ - ramp_} {}
  double duration() const { return 2 * ramp_ + cruise_; }
  double at(double t) const {
    if (t <= 0) return 0;
    if (t < ramp_) return 0.5 * acceleration_ * t * t;
    if (t < ramp_ + cruise_) return speed_ * (t - 0.5 * ramp_);
    const double left = std::max(0.0, duration() - t);
    return distance_ - 0.5 * acceleration_ * left * left;
  }

 private:
  double distance_, speed_, acceleration_, ramp_, cruise_;
};

// One touch in time: along a straight line through the touched point, where the tip sticks.
class Contact {
 public:
  Contact(const procedure::Step& step, const Vector3d& surface, const SetUp& set_up)
      : clearance_mm_{step.clearance_mm},
        retract_{vector(step.touch.retract_direction)},
        surface_{surface},
        dwell_s_{step.kind == procedure::Kind::in_out ? 0 : set_up.dwell_s},
        in_{step.clearance_mm + step.overtravel_mm, step.touch.retract_speed_mm_s, set_up.acceleration_mm_s2},
        out_{step.clearance_mm + step.overtravel_mm + procedure::kRunOut_mm, step.touch.retract_speed_mm_s,
             set_up.acceleration_mm_s2} {}

  double duration() const { return 2 * kLead_s + in_.duration() + dwell_s_ + out_.duration(); }
  Vector3d body(double t) const { return surface_ + outside(t) * retract_; }
  // Of a probe whose gain is the identity.
  Vector3d deflection(double t) const { return std::max(0.0, -outside(t)) * retract_; }

 private:
  double outside(double t) const {
    const double since = t - kLead_s;
    return clearance_mm_ - in_.at(since) + out_.at(since - in_.duration() - dwell_s_);
  }

  double clearance_mm_;
  Vector3d retract_, surface_;
  double dwell_s_;
  Drive in_, out_;
};

// Where a ball of the part stands at C = 0: a third of a turn further and higher than the one before it.
Vector3d ballAt(const SetUp& set_up, std::uint16_t number) {
  const double at_rad = 2 * std::numbers::pi / 3 * (number - 1);
  return set_up.ball_reach_mm * Vector3d{std::cos(at_rad), std::sin(at_rad), static_cast<double>(number)};
}

class Run {
 public:
  Run(const SetUp& set_up, const procedure::Facts& facts, std::uint64_t seed)
      : set_up_{set_up}, facts_{facts}, random_{seed}, recording_{capture::Capacity{}} {
    recording_.clear();
    const double tau = set_up.delay_s;
    recording_.setDelay({.result_id = 1, .tau_s = {tau, tau, tau}, .sd_s = {}, .at = {}});
  }

  // False: the recording is full, as the box's would be.
  bool touch(const procedure::Step& step) {
    const Contact contact{step, surfaceOf(step), set_up_};
    const double from_s = now_s_;
    capture::Touch touch{.request = step.touch,
                         .map = map(),
                         .machine_begin = recording_.machineRowCount(),
                         .machine_end = 0,
                         .probe_begin = recording_.probeRowCount(),
                         .probe_end = 0};
    bool fits = true;
    sample(set_up_.machine_rate_hz, contact.duration(), [&](double t) {
      const Vector3d position = contact.body(t - set_up_.delay_s) + noise(set_up_.machine_noise_um);
      capture::MachineRow row{.at = at(from_s + t), .counts = {}, .screw_nm = {}};
      for (Eigen::Index i = 0; i < 3; ++i)
        row.counts[static_cast<std::size_t>(i)] = std::llround(position[i] * kCountsPerMm);
      fits = recording_.append(row) && fits;
    });
    sample(set_up_.probe_rate_hz, contact.duration(), [&](double t) {
      const Vector3d channels = contact.deflection(t) + noise(set_up_.probe_noise_um);
      capture::ProbeRow row{.at = at(from_s + t), .channels_nm = {}};
      for (Eigen::Index i = 0; i < 3; ++i)
        row.channels_nm[static_cast<std::size_t>(i)] =
            static_cast<std::int32_t>(std::lround(channels[i] * kNanometresPerMm));
      fits = recording_.append(row) && fits;
    });
    touch.machine_end = recording_.machineRowCount();
    touch.probe_end = recording_.probeRowCount();
    const double pause_s = step.touch.rotary_angles_rad == pose_ ? set_up_.between_s : set_up_.turning_s;
    pose_ = step.touch.rotary_angles_rad;
    now_s_ += contact.duration() + pause_s;
    return recording_.append(touch) && fits;
  }

  double duration() const { return now_s_ - kStart_s; }
  const capture::Recording& recording() const { return recording_; }

 private:
  static TickMap map() {
    constexpr std::int64_t kMillisecond_q32 = std::int64_t{1'000'000} << 32;
    return {.tick = {}, .at = {}, .period_q32_ns = kMillisecond_q32, .sigma_ns = 0, .state = ClockState::locked};
  }

  Vector3d surfaceOf(const procedure::Step& step) const {
    const Vector3d n = vector(step.touch.outward_normal);
    const double reach_mm = (set_up_.sphere_diameter_mm + set_up_.stylus_ball_diameter_mm) / 2;
    switch (step.feature) {
      case procedure::Feature::datum_sphere:
        return reach_mm * n - tipOf(step);
      case procedure::Feature::plates:
        return -(set_up_.gap_mm - set_up_.stylus_ball_diameter_mm) / 2 * n;
      case procedure::Feature::part_ball: {
        // A carries the probe, whose stylus is straight: only C and the table move the ball.
        const Eigen::AngleAxisd turn{step.touch.rotary_angles_rad[2], Vector3d::UnitZ()};
        return tilted(turn * ballAt(set_up_, step.touch.ball), step) + reach_mm * n - tipOf(step);
      }
      case procedure::Feature::tool_setter:
        break;  // is not forecast
    }
    return reach_mm * n;
  }

  // About an axis through the middle of the table.
  Vector3d tilted(const Vector3d& ball, const procedure::Step& step) const {
    if (step.b_moves != procedure::BMoves::table) return ball;
    return Eigen::AngleAxisd{step.touch.rotary_angles_rad[1], vector(facts_.tilting_table->axis)} * ball;
  }

  // From what the positions are of to the stylus ball.
  Vector3d tipOf(const procedure::Step& step) const {
    const bool swivels = step.b_moves == procedure::BMoves::head;
    const auto& tools = facts_.probe_tools;
    if (step.touch.tool == 0 && !swivels) return Vector3d::Zero();
    const Vector3d hanging{0, 0, -tools.lengthOf(step.touch.tool != 0 ? step.touch.tool : tools.numbers[0])};
    if (!swivels) return hanging;
    const Vector3d pivot = vector(facts_.swivel_head->pivot_mm);
    return pivot +
           Eigen::AngleAxisd{step.touch.rotary_angles_rad[1], vector(facts_.swivel_head->b.axis)} * (hanging - pivot);
  }

  Vector3d noise(double sigma_um) {
    std::normal_distribution<double> normal{0.0, sigma_um * 1e-3};
    return {normal(random_), normal(random_), normal(random_)};
  }

  void sample(double rate_hz, double duration_s, const auto& take) {
    const double phase = std::uniform_real_distribution<double>{0.0, 1.0}(random_);
    for (double count = phase; count / rate_hz < duration_s; ++count) take(count / rate_hz);
  }

  const SetUp& set_up_;
  const procedure::Facts& facts_;
  Random random_;
  capture::Recording recording_;
  double now_s_{kStart_s};
  std::array<double, 3> pose_{};
};

procedure::CheckedBall checkedBall(const SetUp& set_up) {
  procedure::CheckedBall ball;
  ball.diameter_mm = set_up.sphere_diameter_mm;
  ball.centre_z_mm = set_up.ball_reach_mm;
  return ball;
}

procedure::BallPlate ballPlate(const SetUp& set_up) {
  procedure::BallPlate plate;
  for (std::uint16_t number = 1; number <= 7; ++number) {
    const Vector3d at = ballAt(set_up, number);
    plate.balls_mm.push_back({at.x(), at.y(), at.z()});
  }
  return plate;
}

procedure::Facts factsOf(const SetUp& set_up) {
  constexpr double kPivot_mm = 60;
  const procedure::BFacts head{.axis = {0, 1, 0}, .sigma_rad = set_up.sigma_b_rad};
  return {.sphere_diameter_mm = set_up.sphere_diameter_mm,
          .gap_mm = set_up.gap_mm,
          .stylus_ball_diameter_mm = set_up.stylus_ball_diameter_mm,
          .sigma_c_rad = set_up.sigma_c_rad,
          .screws = {},
          .checked_ball = checkedBall(set_up),
          .ball_plate = ballPlate(set_up),
          .tilting_table = procedure::BFacts{.sigma_rad = set_up.sigma_b_rad},
          .swivel_head =
              procedure::HeadFacts{
                  .b = head, .pivot_mm = {0, 0, kPivot_mm}, .ball_mm = std::array<double, 3>{}, .sd_ball_mm = {}},
          .probe_tools = {.count = 2, .numbers = {1, 2}, .lengths_mm = set_up.tool_lengths_mm}};
}

}  // namespace

SimulatedRun simulatedRun(const procedure::Plan& plan, const SetUp& set_up, std::uint64_t seed) {
  const procedure::Facts facts = factsOf(set_up);
  Run run{set_up, facts, seed};
  for (std::size_t i = 0; i < plan.step_count; ++i) {
    if (!run.touch(plan.steps[i]))
      return {metrology::Refusal{"recording-full",
                                 "the run exceeds the recording capacity of the box: choose fewer or faster touches"},
              run.duration()};
  }
  const capture::Scales scales{.mm_per_count = {1 / kCountsPerMm, 1 / kCountsPerMm, 1 / kCountsPerMm},
                               .nominal_period = std::chrono::milliseconds{1}};
  const auto measured = procedure::runDataset(plan.method, run.recording(), scales, facts);
  if (measured.refusal) return {*measured.refusal, run.duration()};
  return {metrology::solve(measured.dataset), run.duration()};
}

}  // namespace probebox::plan
