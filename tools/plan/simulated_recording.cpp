#include "tools/plan/simulated_recording.hpp"

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>

#include "firmware/capture/near_contact.hpp"
#include "firmware/capture/touch_capture.hpp"
#include "firmware/procedure/plan/step.hpp"
#include "protocol/units/angle.hpp"
#include "tools/plan/contact.hpp"
#include "tools/plan/scan_motion.hpp"
#include "tools/plan/set_up.hpp"
#include "tools/plan/simulated_facts.hpp"

namespace probebox::plan {
namespace {

// Simulates one turn of C until the ball touches the stylus, and back. C turns about Z through the origin. The ball
// sticks to the stylus while it presses.
class Turn {
 public:
  // ball: its centre at C = 0. away: offset of the stylus from its position by the machine, mm.
  Turn(const procedure::Step& step, const Eigen::Vector3d& ball, const Eigen::Vector3d& away, const SetUp& set_up)
      : ball_{ball},
        stylus_{step.touch.travel_mm * vectorOf(step.touch.outward_normal) +
                Eigen::Vector3d{0, ball.head<2>().norm(), ball.z()} + away},
        reach_mm_{(set_up.sphere_diameter_mm + set_up.stylus_ball_diameter_mm) / 2},
        from_rad_{step.touch.rotary_angles_rad[2]},
        to_rad_{step.touch.until_contact->to_rad},
        rate_rad_s_{std::copysign(step.touch.until_contact->speed_rad_s, to_rad_ - from_rad_)},
        contact_rad_{contact()},
        beyond_rad_{std::copysign(step.overtravel_mm / ball.head<2>().norm(), rate_rad_s_)},
        there_s_{(contact_rad_ + beyond_rad_ - from_rad_) / rate_rad_s_},
        dwell_s_{set_up.dwell_s} {}

  double duration() const { return 2 * kRest_s + 2 * there_s_ + dwell_s_; }
  const Eigen::Vector3d& stylus() const { return stylus_; }
  double angle(double t) const {
    const double there_s = std::clamp(t - kRest_s, 0.0, there_s_);
    const double back_s = std::clamp(t - kRest_s - there_s_ - dwell_s_, 0.0, there_s_);
    return from_rad_ + rate_rad_s_ * (there_s - back_s);
  }
  Eigen::Vector3d deflection(double t) const {
    const double pressed_rad = angle(t) - contact_rad_;
    if (pressed_rad * rate_rad_s_ <= 0) return Eigen::Vector3d::Zero();
    return turned(stylus_, pressed_rad) - stylus_;
  }
  // Times at which the stylus is pressed this far.
  double contactTime(double depth_mm) const { return kRest_s + there_s_ - pressing(depth_mm); }
  double releaseTime(double depth_mm) const { return kRest_s + there_s_ + dwell_s_ + pressing(depth_mm); }

 private:
  static constexpr double kRest_s = 0.1;  // before and after

  static Eigen::Vector3d turned(const Eigen::Vector3d& point, double angle_rad) {
    return Eigen::AngleAxisd{angle_rad, Eigen::Vector3d::UnitZ()} * point;
  }
  double contact() const {
    double free = from_rad_, met = to_rad_;
    for (int halving = 0; halving < 60; ++halving) {
      const double middle = (free + met) / 2;
      ((turned(ball_, middle) - stylus_).norm() > reach_mm_ ? free : met) = middle;
    }
    return (free + met) / 2;
  }
  // Time from that depth to the stop.
  double pressing(double depth_mm) const {
    const Eigen::Vector3d at = turned(ball_, contact_rad_), normal = (stylus_ - at).normalized();
    const double mm_s = std::abs(rate_rad_s_ * Eigen::Vector3d::UnitZ().cross(at).dot(normal));
    return beyond_rad_ / rate_rad_s_ - depth_mm / mm_s;
  }

  Eigen::Vector3d ball_, stylus_;
  double reach_mm_, from_rad_, to_rad_, rate_rad_s_, contact_rad_, beyond_rad_, there_s_, dwell_s_;
};

using Eigen::Vector3d;

constexpr double kCountsPerMm = 1e6;
constexpr double kNanometresPerMm = 1e6;
constexpr double kStart_s = 1000;        // any: later than all delays
constexpr double kCuttingRadius_mm = 5;  // any: opposite faces cancel it

MonoTime at(double t_s) {
  return monoTime(std::llround(t_s * 1e9));
}

std::size_t axisAlong(const Vector3d& direction) {
  Eigen::Index along = 0;
  direction.cwiseAbs().maxCoeff(&along);
  return static_cast<std::size_t>(along);
}

// The ball of a step at C = 0. A plate is where it is in every mount, which its own registration takes out; a ball on a
// rod is clamped further out, so far as a rod of a chuck is.
Vector3d mountedAt(const SetUp& set_up, const procedure::Step& step) {
  constexpr double kFurther_mm = 80;
  const Vector3d ball = ballAt(set_up, step.touch.ball);
  if (set_up.plate_in_mounts || step.touch.mount < 2) return ball;
  return ball + kFurther_mm * (step.touch.mount - 1) * Vector3d::UnitZ();
}

// Simulated reading of the sensor at the face of a ball screw: run-out once and twice a turn, and a slow drift.
double screwSensor_um(double turn_rad, double t_s) {
  return 3 * std::sin(turn_rad) + 0.8 * std::sin(2 * turn_rad) + 0.02 * t_s;
}

}  // namespace

SimulatedRecording::SimulatedRecording(const SetUp& set_up, const procedure::Facts& facts, std::uint64_t seed)
    : set_up_{set_up}, facts_{facts}, random_{seed}, recording_{capture::Capacity{}}, now_s_{kStart_s} {
  recording_.clear();
  const double tau = set_up.delay_s;
  recording_.setDelay({.result_id = 1, .tau_s = {tau, tau, tau}, .sd_s = set_up.sd_delay_s, .at = {}});
  for (std::size_t axis = 0; axis < kRotaryAxes; ++axis) beside_rad_[axis] = stopOff(axis);
  head_beside_rad_ = normal(set_up.head.sigma_rad);
}

double SimulatedRecording::duration() const {
  return now_s_ - kStart_s;
}

capture::Scales SimulatedRecording::scales() const {
  return {.mm_per_count = {1 / kCountsPerMm, 1 / kCountsPerMm, 1 / kCountsPerMm},
          .nominal_period = std::chrono::milliseconds{1}};
}

// An axis keeps its stop until it is sent elsewhere.
void SimulatedRecording::stopAt(const procedure::Step& step) {
  for (std::size_t axis = 0; axis < kRotaryAxes; ++axis) {
    if (step.touch.rotary_angles_rad[axis] == pose_[axis]) continue;
    const bool of_head = axis == 1 && step.b_moves == procedure::BMoves::head;
    if (of_head)
      head_beside_rad_ = normal(set_up_.head.sigma_rad);
    else
      beside_rad_[axis] = stopOff(axis);
  }
}

// The spindle carries a straight stylus, so its stops move nothing.
double SimulatedRecording::stopOff(std::size_t axis) {
  const std::array<double, kRotaryAxes> sigma_rad{0, set_up_.table.sigma_rad, set_up_.sigma_c_rad};
  return normal(sigma_rad[axis]);
}

bool SimulatedRecording::take(const procedure::Step& step) {
  stopAt(step);
  if (step.kind == procedure::Kind::sweep) return sweep(step);
  if (step.kind == procedure::Kind::rest) return rest(step);
  if (step.kind == procedure::Kind::scan) return scan(step);
  if (step.kind == procedure::Kind::turn) return turn(step);
  return step.kind == procedure::Kind::hold ? hold(step) : touch(step);
}

capture::Touch SimulatedRecording::begin(const procedure::Step& step) const {
  constexpr std::int64_t kMillisecond_q32 = std::int64_t{1'000'000} << 32;
  capture::Touch touch{
      .request = step.touch,
      .map = {.tick = {}, .at = {}, .period_q32_ns = kMillisecond_q32, .sigma_ns = 0, .state = ClockState::locked}};
  touch.machine_begin = recording_.machineRowCount();
  touch.probe_begin = recording_.probeRowCount();
  touch.drift_begin = recording_.driftRowCount();
  touch.angle_begin = recording_.angleRowCount();
  return touch;
}

bool SimulatedRecording::end(capture::Touch touch, double duration_s) {
  touch.machine_end = recording_.machineRowCount();
  touch.probe_end = recording_.probeRowCount();
  touch.drift_end = recording_.driftRowCount();
  touch.angle_end = recording_.angleRowCount();
  const double pause_s = touch.request.rotary_angles_rad == pose_ ? set_up_.between_s : set_up_.turning_s;
  pose_ = touch.request.rotary_angles_rad;
  now_s_ += duration_s + pause_s;
  capture::keepNearContact(recording_, touch);
  return recording_.append(touch);
}

bool SimulatedRecording::touch(const procedure::Step& step) {
  const Contact contact{step, surfaceOf(step), set_up_};
  auto touch = begin(step);
  bool fits = sample(set_up_.machine_rate_hz, contact.duration(), [&](double t) {
    return machineRow(t, contact.body(t - set_up_.delay_s) + noise(set_up_.machine_noise_um));
  });
  if (step.touch.by_edges) {
    switches(touch, contact);
  } else {
    const Vector3d surface = surfaceOf(step), n = vectorOf(step.touch.outward_normal);
    const auto channels = [&](double t) -> Vector3d {
      if (!facts_.distance_probe) return contact.deflection(t);
      return {facts_.distance_probe->stand_off_mm + n.dot(contact.body(t) - surface), 0, 0};
    };
    fits = fits && sample(set_up_.probe_rate_hz, contact.duration(),
                          [&](double t) { return probeRow(t, channels(t) + noise(set_up_.probe_noise_um)); });
  }
  return end(touch, contact.duration()) && fits;
}

// A setting device switches at one depth in and out; the switch of a probe opens and closes each by itself.
void SimulatedRecording::switches(capture::Touch& touch, const Contact& contact) {
  const bool of_probe = touch.request.switch_of == capture::SwitchOf::probe;
  const double sd_mm = 1e-3 * (of_probe ? *set_up_.switch_repeatability_um : set_up_.setter_repeatability_um);
  const double in_mm = normal(sd_mm), out_mm = of_probe ? normal(sd_mm) : in_mm;
  touch.contact = at(now_s_ + contact.contactTime(in_mm));
  touch.release = at(now_s_ + contact.releaseTime(out_mm));
}

// The head stands still beside the middle of a ball, and its sensors show by how much.
bool SimulatedRecording::hold(const procedure::Step& step) {
  const Vector3d off = step.touch.travel_mm * vectorOf(step.touch.outward_normal);
  const auto& rows = facts_.sensor_head->calibrated->matrix;
  const Vector3d sensors{vectorOf(rows[0]).dot(-off), vectorOf(rows[1]).dot(-off), vectorOf(rows[2]).dot(-off)};
  const auto touch = begin(step);
  const Vector3d position = ballOf(step) + off - movedByHead(firstTip());
  const bool fits = sample(set_up_.machine_rate_hz, set_up_.hold_s,
                           [&](double t) { return machineRow(t, position + noise(set_up_.machine_noise_um)); }) &&
                    sample(set_up_.probe_rate_hz, set_up_.hold_s,
                           [&](double t) { return probeRow(t, sensors + noise(set_up_.head_noise_um)); });
  return end(touch, set_up_.hold_s) && fits;
}

bool SimulatedRecording::sweep(const procedure::Step& step) {
  const Vector3d along = vectorOf(step.touch.outward_normal);
  const auto& screw = *facts_.screws.at(axisAlong(along));
  const Drive drive{step.touch.travel_mm, step.touch.retract_speed_mm_s, set_up_.acceleration_mm_s2};
  const auto touch = begin(step);
  const double interval_s = std::chrono::duration<double>{capture::kSweepInterval}.count();
  const auto positions = [&](double t) { return machineRow(t, drive.at(t) * along + noise(set_up_.machine_noise_um)); };
  const auto readings = [&](double t) {
    const double turn_rad = kTurn * (drive.at(t) - screw.sector_zero_mm) / screw.pitch_mm;
    return driftRow(t, screwSensor_um(turn_rad, t) + normal(set_up_.screw_noise_um));
  };
  const bool fits = sample(1 / interval_s, drive.duration() + 2 * interval_s, positions) &&
                    sample(set_up_.screw_rate_hz, drive.duration(), readings);
  return end(touch, drive.duration()) && fits;
}

// The screw is cold and stands with its sensor over one place of its face.
bool SimulatedRecording::rest(const procedure::Step& step) {
  const auto touch = begin(step);
  const double interval_s = std::chrono::duration<double>{capture::kSweepInterval}.count();
  const bool fits = sample(1 / interval_s, step.touch.rest_s + 2 * interval_s,
                           [&](double t) { return machineRow(t, noise(set_up_.machine_noise_um)); }) &&
                    sample(set_up_.screw_rate_hz, step.touch.rest_s,
                           [&](double t) { return driftRow(t, normal(set_up_.screw_noise_um)); });
  return end(touch, step.touch.rest_s) && fits;
}

bool SimulatedRecording::scan(const procedure::Step& step) {
  const ScanMotion motion{step, set_up_};
  const auto touch = begin(step);
  const auto positions = [&](double t) {
    return machineRow(t, motion.body(t - set_up_.delay_s) + noise(set_up_.machine_noise_um));
  };
  const auto deflections = [&](double t) { return probeRow(t, motion.deflection(t) + noise(set_up_.probe_noise_um)); };
  const bool fits = sample(set_up_.machine_rate_hz, motion.duration(), positions) &&
                    sample(set_up_.probe_rate_hz, motion.duration(), deflections);
  return end(touch, motion.duration()) && fits;
}

// The stylus stands beside the line; the ball comes to it, presses it aside, and goes back.
bool SimulatedRecording::turn(const procedure::Step& step) {
  auto touch = begin(step);
  const Vector3d ball = ballAt(set_up_, step.touch.ball), met{0, ball.head<2>().norm(), ball.z()};
  const Vector3d away =
      movedByHead(firstTip()) - (tilted(met, beside_rad_[1]) - met);  // of the stylus, seen from the ball
  const Turn motion{step, ball, away, set_up_};
  beside_rad_[2] = stopOff(2);  // C has moved, and its encoder does not see how far it stands beside
  const double interval_s = std::chrono::duration<double>{capture::kSweepInterval}.count();
  const bool fits = sample(1 / interval_s, motion.duration(), [&](double t) {
    return machineRow(t, motion.stylus() - away + noise(set_up_.machine_noise_um)) &&
           recording_.append(capture::AngleRow{at(now_s_ + t), motion.angle(t) - beside_rad_[2]}) &&
           (step.touch.by_edges || probeRow(t, motion.deflection(t) + noise(set_up_.probe_noise_um)));
  });
  if (step.touch.by_edges) {
    const double sd_mm = 1e-3 * *set_up_.switch_repeatability_um;
    touch.contact = at(now_s_ + motion.contactTime(normal(sd_mm)));
    touch.release = at(now_s_ + motion.releaseTime(normal(sd_mm)));
  }
  return end(touch, motion.duration()) && fits;
}

bool SimulatedRecording::machineRow(double t, const Vector3d& position) {
  capture::MachineRow row{.at = at(now_s_ + t), .counts = {}, .screw_nm = {}};
  for (Eigen::Index i = 0; i < 3; ++i)
    row.counts[static_cast<std::size_t>(i)] = std::llround(position[i] * kCountsPerMm);
  return recording_.append(row);
}

bool SimulatedRecording::probeRow(double t, const Vector3d& channels_mm) {
  capture::ProbeRow row{.at = at(now_s_ + t), .channels_nm = {}};
  for (Eigen::Index i = 0; i < 3; ++i)
    row.channels_nm[static_cast<std::size_t>(i)] =
        static_cast<std::int32_t>(std::lround(channels_mm[i] * kNanometresPerMm));
  return recording_.append(row);
}

bool SimulatedRecording::driftRow(double t, double reading_um) {
  return recording_.append(
      capture::DriftRow{.at = at(now_s_ + t), .reading_nm = static_cast<std::int32_t>(std::lround(reading_um * 1e3))});
}

Vector3d SimulatedRecording::surfaceOf(const procedure::Step& step) const {
  const Vector3d n = vectorOf(step.touch.outward_normal);
  const bool by_shank = step.touch.shank_height_mm > 0;
  const double touching_mm = by_shank ? 2 * set_up_.shank_radius_mm : set_up_.stylus_ball_diameter_mm;
  const double reach_mm = (set_up_.sphere_diameter_mm + touching_mm) / 2;
  switch (step.feature) {
    case procedure::Feature::datum_sphere:
      return (by_shank ? reach_mm : touchedSphere_mm(set_up_) / 2) * n + ballOf(step) - tipOf(step);
    case procedure::Feature::part_ball:
    case procedure::Feature::second_part_ball:
      return ballOf(step) + reach_mm * n - tipOf(step);
    case procedure::Feature::plates:
      return -(set_up_.gaps_mm.at(axisAlong(n)) - set_up_.stylus_ball_diameter_mm) / 2 * n;
    case procedure::Feature::cylinder: {
      const double side = set_up_.cylinder_inside ? -1 : 1;
      return (side * set_up_.cylinder_diameter_mm + set_up_.stylus_ball_diameter_mm) / 2 * n;
    }
    case procedure::Feature::cube:
      return (set_up_.cube_edges_mm.at(axisAlong(n)) + set_up_.stylus_ball_diameter_mm) / 2 * n;
    case procedure::Feature::tool_setter:
      return setterFaceOf(step);
  }
  return reach_mm * n;
}

// Position at a face of the device, whose middle is the origin, with the probe or the tool in the spindle.
Vector3d SimulatedRecording::setterFaceOf(const procedure::Step& step) const {
  const Vector3d n = vectorOf(step.touch.outward_normal);
  const std::size_t axis = axisAlong(n);
  const bool probe = step.touch.tool == 0, end_face = axis == 2;
  const double tool_reach_mm = end_face ? 0 : kCuttingRadius_mm;
  const double reach_mm = probe ? set_up_.stylus_ball_diameter_mm / 2 : tool_reach_mm;
  const auto tool = std::ranges::find(facts_.tools, step.touch.tool, &procedure::ToolFacts::number);
  const double length_mm = tool != facts_.tools.end() ? tool->length_mm : 0;  // of a tool that the box would refuse
  const Vector3d hanging = probe ? vectorOf(facts_.tool_setter->probe_offset_mm) : Vector3d{0, 0, -length_mm};
  return (set_up_.setter_half_width_mm.at(axis) + reach_mm) * n - hanging;
}

// Middle of the ball that the step is about.
Vector3d SimulatedRecording::ballOf(const procedure::Step& step) const {
  if (!procedure::isOnPart(step.feature)) return Vector3d::Zero();
  // A carries the probe, whose stylus is straight: only C and the table move the ball.
  const Eigen::AngleAxisd turn{step.touch.rotary_angles_rad[2] + beside_rad_[2], Vector3d::UnitZ()};
  const Vector3d ball = turn * mountedAt(set_up_, step);
  const bool tilts = step.b_moves == procedure::BMoves::table;
  return tilted(ball, beside_rad_[1] + (tilts ? step.touch.rotary_angles_rad[1] : 0));
}

// Place of a ball that is there with the table level.
Vector3d SimulatedRecording::tilted(const Vector3d& ball, double angle_rad) const {
  const procedure::BFacts& table = *facts_.tilting_table;
  const Vector3d on_axis = vectorOf(table.point_mm.value_or(std::array<double, 3>{}));
  return on_axis + Eigen::AngleAxisd{angle_rad, vectorOf(table.axis)} * (ball - on_axis);
}

Vector3d SimulatedRecording::firstTip() const {
  return {0, 0, -facts_.probe_tools.lengthOf(facts_.probe_tools.numbers[0])};
}

// From where a tip hangs with the head level.
Vector3d SimulatedRecording::movedByHead(const Vector3d& tip, double swivel_rad) const {
  const Vector3d arm = tip - vectorOf(facts_.swivel_head->pivot_mm);
  return Eigen::AngleAxisd{swivel_rad + head_beside_rad_, vectorOf(facts_.swivel_head->b.axis)} * arm - arm;
}

// From what the positions are of to what touches.
Vector3d SimulatedRecording::tipOf(const procedure::Step& step) const {
  const bool swivels = step.b_moves == procedure::BMoves::head;
  const auto first = facts_.probe_tools.numbers[0];
  const double length_mm = facts_.lengthOf(step.touch.tool != 0 ? step.touch.tool : first);
  const Vector3d hanging{0, 0, -(length_mm - step.touch.shank_height_mm)};
  const Vector3d moved = movedByHead(hanging, swivels ? step.touch.rotary_angles_rad[1] : 0);
  return step.touch.tool == 0 && !swivels ? moved : Vector3d{hanging + moved};
}

double SimulatedRecording::normal(double sigma) {
  return sigma * std::normal_distribution<double>{}(random_);
}

Vector3d SimulatedRecording::noise(double sigma_um) {
  std::normal_distribution<double> normal{0.0, sigma_um * 1e-3};
  return {normal(random_), normal(random_), normal(random_)};
}

bool SimulatedRecording::sample(double rate_hz, double duration_s, const auto& take) {
  const double phase = std::uniform_real_distribution<double>{0.0, 1.0}(random_);
  for (double count = phase; count / rate_hz < duration_s; ++count) {
    if (!take(count / rate_hz)) return false;
  }
  return true;
}

}  // namespace probebox::plan
