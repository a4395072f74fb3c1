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
    return world::Prompt{.run = 1, .state = world::RunState::waiting, .tool = kNoSuchTool};
  }
};

StandingLink& standing() {
  static StandingLink link;
  return link;
}

void describeMachine(box::BoxConfig& box) {
  box.corrections.swivel.fitted = true;
  box.corrections.angles[1] = {
      .described = true, .from = corrections::AngleFrom::controller, .reference = {}, .stale = {}};
}

}  // namespace

Control::Control(std::uint64_t seed)
    : office_{2U << 20U, stream::TriggerHistory::kKept, warmingWorld(), seed},
      boot_{office_, folder_.file("results.db")} {
  office_.scenario().describeBy(describeMachine);
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
  if (at_move) at_move();
  commanded_.push_back({Commanded::Is::move, to_mm, feed_mm_min, guarded});
  lowest_mm = std::min(lowest_mm, to_mm[2]);
  if (!scenario.world().machine().moveTo(to, feed_mm_min / 60, scenario.now())) throw Alarm{"the machine did not move"};
  settle();
  if (guarded && contacts() != before) throw Touched{};
}

void Control::turn(const std::array<double, 3>& to_deg) {
  settle();
  commanded_.push_back({Commanded::Is::turn, to_deg, 0, false});
  const auto& [a, b, c] = to_deg;
  const world::Pose pose{.a_rad = a * kDegree, .head_rad = b * kDegree, .c_rad = c * kDegree};
  if (!office_.scenario().world().machine().turnTo(pose, office_.scenario().now())) throw Alarm{"nothing turned"};
  angles_deg_ = to_deg;
  settle();
}

void Control::takeTool(unsigned number) {
  settle();
  commanded_.push_back({Commanded::Is::tool, {number * 1.0}, 0, false});
  if (!office_.scenario().world().machine().takeTool(number, office_.scenario().now())) throw Alarm{"no such tool"};
  tool_ = number;
  settle();
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
  commanded_.push_back({Commanded::Is::stop, {}, 0, false});
  if (at_stop) at_stop();
}

double Control::position(char axis) {
  if (axis >= 'X') return office_.scenario().machine().commandedPosition().at(static_cast<std::size_t>(axis - 'X'));
  return angles_deg_.at(static_cast<std::size_t>(axis - 'A'));
}

}  // namespace probebox::scenario
