#include "firmware/procedure/methods/plate_poses.hpp"

#include <cmath>
#include <cstddef>
#include <string>

#include "firmware/procedure/plan/live_method.hpp"

namespace probebox::procedure {
namespace {

constexpr std::size_t kMostMounts = 4;
constexpr std::size_t kFewestBalls = 3;  // off one line they fix six errors

std::size_t stopCount(const ProcedureOptions& with) {
  return with.axis == kAxisB ? anglesOfB(with).size() : with.angles;
}

std::size_t ballsAtAStop(const ProcedureOptions& with) {
  return with.stations > 0 ? with.stations : with.balls;
}

std::size_t readingsOfAMount(const ProcedureOptions& with) {
  return stopCount(with) * ballsAtAStop(with) + with.balls;
}

// The ball that a turn by this brings to where ball `station` (from 0) stands at zero.
std::uint16_t ballAt(const ProcedureOptions& with, std::size_t station, double angle_rad) {
  const auto balls = static_cast<long>(with.balls);
  const long pitches = std::lround(angle_rad / kTurn_rad * static_cast<double>(balls));
  const long ball = (static_cast<long>(station) - pitches) % balls;
  return static_cast<std::uint16_t>((ball + balls) % balls + 1);
}

Pose plateAt(const ProcedureOptions& with, const LoopState&, std::size_t index) {
  const bool about_b = with.axis == kAxisB;
  const std::size_t a_mount = readingsOfAMount(with), a_stop = ballsAtAStop(with);
  const std::size_t in_mount = index % a_mount, stop = in_mount / a_stop, station = in_mount % a_stop;
  Pose pose{.b_moves = about_b ? BMoves::table : BMoves::nothing,
            .mount = static_cast<std::uint16_t>(index / a_mount + 1)};
  if (stop >= stopCount(with)) {
    pose.ball = static_cast<std::uint16_t>(in_mount - stopCount(with) * a_stop + 1);
    return pose;
  }
  const double angle_rad = about_b ? anglesOfB(with)[stop] : angleOfC(with, 0, stop);
  pose.angles_rad[about_b ? 1 : 2] = angle_rad;
  pose.note = noteOfStop(static_cast<std::uint16_t>(stop + 1));
  pose.ball = with.stations > 0 ? ballAt(with, station, angle_rad) : static_cast<std::uint16_t>(station + 1);
  return pose;
}

}  // namespace

constinit const Poses kOnPlate{
    .count = [](const ProcedureOptions& with, const LoopState&) { return with.mounts * readingsOfAMount(with); },
    .at = plateAt};

std::optional<Error> whyNoPlate(const ProcedureOptions& with) {
  if (with.mounts > kMostMounts)
    return Error{std::to_string(with.mounts) + " mounts are out of range: give 1 to " + std::to_string(kMostMounts) +
                 " mounts."};
  if (with.stations > with.balls)
    return Error{"There are " + std::to_string(with.stations) + " stations, but " + std::to_string(with.balls) +
                 " balls: give at most as many stations as balls."};
  const std::size_t at_an_angle = with.mounts * ballsAtAStop(with);
  if (with.balls < kFewestBalls || at_an_angle >= kFewestBalls) return std::nullopt;  // too few balls: refused anyway
  return Error{"Only " + std::to_string(at_an_angle) +
               " balls would be read at each angle, and the six errors need 3: give more stations or mounts."};
}

}  // namespace probebox::procedure
