#include "control.hpp"

#include <algorithm>
#include <cmath>

#include "protocol/units/angle.hpp"

namespace probebox::scenario {
namespace {

using namespace std::chrono_literals;
namespace address = modbus::address;

constexpr Nanoseconds kPlcCycle = 10ms, kWorkerRound = 100ms;

// The emulated controller stands still: the program commands the machine.
class StandingLink : public world::BoxLink {
 public:
  void postMarker(const Marker&) override {}
  std::optional<bool> markerAnswer() override { return std::nullopt; }
  void home(const world::Vector3&) override {}
  void askProcedureStatus() override {}
  std::optional<world::Prompt> procedureStatus() override {
    constexpr std::uint32_t kNoSuchTool = 9999;
    return world::Prompt{Step{.tool = kNoSuchTool}, 1, RunState::waiting};
  }
};

StandingLink& standing() {
  static StandingLink link;
  return link;
}

void describeHead(box::BoxConfig& box) {
  box.corrections.swivel.fitted = true;
  box.corrections.angles[1] = {
      .described = true, .from = corrections::AngleFrom::controller, .reference = {}, .stale = {}};
}

}  // namespace

// Two more mounts of the balls: turned about C, and shifted.
world::Config worldOfTheLoop() {
  auto config = warmingWorld();
  config.part_spindle.further_mounts = {{.turn_rad = {0, 0, 15 * kDegree}, .shift_mm = {0, 0, 30}},
                                        {.turn_rad = {0, 0, -20 * kDegree}, .shift_mm = {5, 0, 10}}};
  return config;
}

world::Config worldFor(const procedure::Facts& facts) {
  return facts.has_y ? worldOfTheLoop() : warmingLatheWorld();
}

Control::Control(std::uint64_t seed, char table, const procedure::Facts& facts)
    : table_{table},
      world_{worldFor(facts)},
      office_{2U << 20U, stream::TriggerHistory::kKept, world_, seed},
      boot_{office_, folder_.file("results.db"), facts} {
  office_.scenario().facts = facts;
  if (facts.swivel_head) office_.scenario().describeBy(describeHead);
  office_.restartBox(boot_.restored());
  office_.scenario().speakThrough(standing());
  office_.scenario().recorder().keeps_bytes = false;
  run(5s);
}

void Control::run(Nanoseconds duration) {
  for (Nanoseconds done{}; done < duration;) {
    const auto slice = std::min<Nanoseconds>(kPlcCycle, duration - done);
    office_.scenario().run(slice);
    done += slice;
    since_plc_ += slice;
    since_worker_ += slice;
    if (since_plc_ >= kPlcCycle) {
      since_plc_ = {};
      plc_.cycle();
    }
    if (since_worker_ < kWorkerRound) continue;
    since_worker_ = {};
    boot_.look();
    if (registers_.value(address::step_state) == 3) boot_.solve();
  }
}

void Control::wait(double s) {
  run(Nanoseconds{std::llround(1e9 * s)});
  if (at_wait) at_wait();
}

void Control::settle() {
  while (!office_.scenario().machine().atRest(office_.scenario().now())) run(10ms);
}

void Control::move(const std::array<double, 3>& to_mm, double feed_mm_min, bool guarded) {
  settle();
  auto& scenario = office_.scenario();
  const auto before = contacts();
  const world::Vector3 to{to_mm[0], to_mm[1], to_mm[2]};
  double way_mm = 0;
  for (std::size_t i = 0; i < 3; ++i) way_mm += std::abs(to[i] - scenario.machine().commandedPosition()[i]);
  if (way_mm < 1e-6) return;
  if (feed_mm_min <= 0) throw Alarm{"a move without a feed"};
  if (at_move) at_move();
  commanded_.push_back({.is = Commanded::Is::move, .to = to_mm, .feed = feed_mm_min, .guarded = guarded});
  lowest_mm = std::min(lowest_mm, to_mm[2]);
  auto& machine = scenario.world().machine();
  constexpr double kBeyond_mm = 0.002;  // until the axes stand
  const double speed_mm_s = feed_mm_min / 60;
  if (guarded && !machine.touching()) {
    machine.moveUntilContact(to, speed_mm_s, scenario.now(), kBeyond_mm);
  } else if (!(slides(to) ? machine.slideTo(to, speed_mm_s, scenario.now())
                          : machine.moveTo(to, speed_mm_s, scenario.now()))) {
    throw Alarm{"the machine did not move"};
  }
  settle();
  if (guarded && contacts() != before) throw Touched{};
}

void Control::seek(const std::array<double, 3>& to_mm, double feed_mm_min) {
  try {
    move(to_mm, feed_mm_min, true);
  } catch (const Touched&) {
    return;
  }
}

// From within the surface of the datum sphere to another point within: the stylus slides along it.
bool Control::slides(const world::Vector3& to_mm) {
  using world::operator+, world::operator-;
  const auto& machine = office_.scenario().machine();
  if (!machine.touching()) return false;
  const auto& sphere = world_.sphere;
  const auto tip_mm = machine.bodyFor(to_mm) + machine.tipIn(machine.commandedPose(), machine.tool());
  return world::norm(tip_mm - sphere.centre_mm) < sphere.radius_mm + sphere.stylus_ball_radius_mm;
}

void Control::arc(const std::array<double, 2>& to_mm, const std::array<double, 2>& centre_mm, double feed_mm_min,
                  bool clockwise) {
  settle();
  auto& scenario = office_.scenario();
  const auto here_mm = scenario.machine().commandedPosition();
  const world::Vector3 centre{here_mm[0] + centre_mm[0], here_mm[1] + centre_mm[1], here_mm[2]};
  const auto directionOf = [&](double x, double y) { return std::atan2(y - centre[1], x - centre[0]); };
  double turn_rad = directionOf(to_mm[0], to_mm[1]) - directionOf(here_mm[0], here_mm[1]);
  if (clockwise && turn_rad >= 0) turn_rad -= kTurn;
  if (!clockwise && turn_rad <= 0) turn_rad += kTurn;
  const double radius_mm = std::hypot(centre_mm[0], centre_mm[1]);
  if (std::abs(std::hypot(to_mm[0] - centre[0], to_mm[1] - centre[1]) - radius_mm) > 1e-3)
    throw Alarm{"the end of an arc is not on its circle"};
  commanded_.push_back({.is = Commanded::Is::arc,
                        .to = {to_mm[0], to_mm[1], here_mm[2]},
                        .feed = feed_mm_min,
                        .centre = centre_mm,
                        .clockwise = clockwise});
  if (!scenario.world().machine().slideRound(centre, turn_rad, feed_mm_min / 60, scenario.now()))
    throw Alarm{"the machine did not move"};
  settle();
}

world::Pose Control::poseOf(const std::array<double, 3>& angles_deg) const {
  const auto& [a, b, c] = angles_deg;
  return {.a_rad = table_ == 'A' ? 0 : a * kDegree,
          .head_rad = table_ == 'B' ? 0 : b * kDegree,
          .table_rad = table_ == 'A'   ? a * kDegree
                       : table_ == 'B' ? b * kDegree
                                       : 0,
          .c_rad = c * kDegree};
}

void Control::watchTip(const std::array<double, 3>& from_deg, const std::array<double, 3>& to_deg) {
  constexpr int kParts = 90;
  const auto& machine = office_.scenario().machine();
  const double level_mm = machine.tipIn({}, 1)[2];
  for (int part = 0; part <= kParts; ++part) {
    std::array<double, 3> at{};
    for (std::size_t i = 0; i < 3; ++i) at[i] = from_deg[i] + (to_deg[i] - from_deg[i]) * part / kParts;
    const double below_mm = level_mm - machine.tipIn(poseOf(at), machine.tool())[2];
    lowest_tip_mm = std::min(lowest_tip_mm, machine.commandedPosition()[2] - below_mm);
  }
}

void Control::turn(const std::array<double, 3>& to_deg, double feed_deg_min) {
  settle();
  if (to_deg == angles_deg_) return;
  watchTip(angles_deg_, to_deg);
  commanded_.push_back({.is = Commanded::Is::turn, .to = to_deg, .feed = feed_deg_min});
  auto& machine = office_.scenario().world().machine();
  const auto now = office_.scenario().now();
  const bool turns = feed_deg_min > 0 ? machine.turnTo(poseOf(to_deg), feed_deg_min / 60 * kDegree, now)
                                      : machine.turnTo(poseOf(to_deg), now);
  if (!turns) throw Alarm{"nothing turned"};
  angles_deg_ = to_deg;
  settle();
}

void Control::turnUntilTouched(double c_deg, double feed_deg_min) {
  constexpr double kBeyond_rad = 0.0003;  // until the drive of C stands
  settle();
  auto& scenario = office_.scenario();
  commanded_.push_back(
      {.is = Commanded::Is::turn_until_touched, .to = {angles_deg_[0], angles_deg_[1], c_deg}, .feed = feed_deg_min});
  auto& machine = scenario.world().machine();
  if (!machine.turnUntilContact(c_deg * kDegree, feed_deg_min / 60 * kDegree, scenario.now(), kBeyond_rad))
    throw Alarm{"C did not turn"};
  angles_deg_[2] = degrees(machine.commandedPose().c_rad);
  settle();
}

void Control::takeTool(unsigned number) {
  settle();
  commanded_.push_back({.is = Commanded::Is::tool, .to = {number * 1.0}});
  if (!office_.scenario().world().machine().takeTool(number, office_.scenario().now())) throw Alarm{"no such tool"};
  tool_ = number;
  settle();
  watchTip(angles_deg_, angles_deg_);
  if (at_tool) at_tool();
}

void Control::shove(const std::array<double, 3>& to_mm) {
  constexpr double kFast_mm_s = 100;
  settle();
  const world::Vector3 to{to_mm[0], to_mm[1], to_mm[2]};
  auto& scenario = office_.scenario();
  if (!scenario.world().machine().moveTo(to, kFast_mm_s, scenario.now())) throw Alarm{"the machine did not move"};
  settle();
}

void Control::stop() {
  commanded_.push_back({.is = Commanded::Is::stop});
  if (at_stop) at_stop();
}

void Control::mountBalls(std::size_t mount) {
  if (!office_.scenario().world().machine().mountBalls(mount, office_.scenario().now())) throw Alarm{"no such mount"};
  settle();
}

double Control::position(char axis) {
  if (axis >= 'X') return office_.scenario().machine().commandedPosition().at(static_cast<std::size_t>(axis - 'X'));
  return angles_deg_.at(static_cast<std::size_t>(axis - 'A'));
}

double Control::positionOfTheBox(char axis) {
  if (table_ == 'A' && axis == 'A') return 0;
  return position(table_ == 'A' && axis == 'B' ? 'A' : axis);
}

}  // namespace probebox::scenario
