#include "host-tests/campaign/follower.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

#include "protocol/modbus/map.hpp"

namespace probebox::campaign {
namespace {

namespace address = modbus::address;

constexpr double kResolution_mm = 1e-6;
// Records that come late and together move a value at once by what it covers in this time at its limit of rate.
constexpr double kPublishing_s = 0.05;
// T_hold of the emulated machine, and as long again as a beat and a restart of the clock may take.
constexpr double kHeldFor_s = 7;

double seconds(Nanoseconds duration) {
  return std::chrono::duration<double>{duration}.count();
}

std::string um(double value_mm) {
  return std::to_string(value_mm * 1e3) + " um";
}

}  // namespace

std::int32_t Follower::i32(std::size_t address) const {
  return std::bit_cast<std::int32_t>(static_cast<std::uint32_t>(image_.registers()[address]) << 16U |
                                     image_.registers()[address + 1]);
}

std::optional<std::string> Follower::read(const published::Snapshot& snapshot, MonoTime now) {
  image_.fill(snapshot, {}, nullptr, modbus::WordOrder::high_first);
  ++reads_;
  if (auto torn = whyTorn()) return torn;
  const bool valid = (image_[address::status] & published::kValid) != 0;
  if (auto beats = whyBeatsWrong(valid, now)) return beats;
  if (!valid) return std::nullopt;
  ++valid_reads_;
  std::array<double, 3> served_mm{};
  for (std::size_t axis = 0; axis < 3; ++axis) served_mm[axis] = i32(address::correction_i32 + 2 * axis) * 1e-6;
  auto fast = whyTooFast(served_mm, now);
  joints_mm_ = served_mm;
  followed_at_ = now;
  outage_.reset();
  return fast;
}

// The three formats say the same, each to its resolution.
std::optional<std::string> Follower::whyTorn() const {
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto fine_nm = i32(address::correction_i32 + 2 * axis);
    const auto coarse = static_cast<std::int16_t>(image_.registers()[address::correction_i16 + axis]);
    const auto offset = image_.registers()[address::correction_offset + axis];
    const auto real_mm = std::bit_cast<float>(i32(address::correction_f32 + 2 * axis));
    const bool alike = std::abs(coarse * 100.0 - fine_nm) <= 51 && offset == coarse + 32768 &&
                       std::abs(static_cast<double>(real_mm) - fine_nm * 1e-6) <= 1e-6;
    if (!alike) return "the formats of the correction differ on axis " + std::to_string(axis);
  }
  return std::nullopt;
}

void Follower::expectRestart(MonoTime now, double doubt_s) {
  beat_.reset();
  if (!outage_) outage_ = Outage{.since = now, .doubt_s = 0};
  outage_->doubt_s = std::max(outage_->doubt_s, doubt_s);
}

// Between two values that a joint follows lies no more than it covers at the limit of rate in the time in which the
// value may have moved: a polling interval before a pause and one after it, because a value that is not valid is
// frozen; and behind an end of the box, for as long as it waits,
// what it is in doubt about.
std::optional<std::string> Follower::whyTooFast(const std::array<double, 3>& served_mm, MonoTime now) const {
  if (!followed_at_) return std::nullopt;  // the joints stand at zero, without an offset
  double moving_s = std::min(seconds(now - *followed_at_), 2 * seconds(poll_interval_)) + kPublishing_s;
  if (outage_) moving_s += std::min(outage_->doubt_s, seconds(now - outage_->since));
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double step_mm = std::abs(served_mm[axis] - joints_mm_[axis]);
    const double allowed_mm = rate_mm_s_[axis] * moving_s + 2 * kResolution_mm;
    if (step_mm > allowed_mm) {
      return "joint " + std::to_string(axis) + " steps by " + um(step_mm) + " where " + um(allowed_mm) +
             " are allowed: from " + um(joints_mm_[axis]) + " to " + um(served_mm[axis]);
    }
  }
  return std::nullopt;
}

// Never faster than 0.1 s a beat; and corrections are not valid for longer than T_hold without a beat.
std::optional<std::string> Follower::whyBeatsWrong(bool valid, MonoTime now) {
  const std::uint16_t beat = image_[address::heartbeat];
  if (!beat_) {
    beat_ = Beat{.since = now, .moved = now, .last = beat, .beats = 0};
    return std::nullopt;
  }
  // Where nothing is summed there is no chain, and the correction is zero whatever is silent.
  const bool sums = image_.registers()[address::mask] != 0;
  if (beat != beat_->last || !valid || !sums) beat_->moved = now;
  if (seconds(now - beat_->moved) > kHeldFor_s)
    return "the corrections are valid, and the heartbeat has not moved for " +
           std::to_string(seconds(now - beat_->moved)) + " s";
  beat_->beats += static_cast<std::uint16_t>(beat - beat_->last);
  beat_->last = beat;
  const double expected = seconds(now - beat_->since) / 0.1;
  if (static_cast<double>(beat_->beats) > expected + 2)
    return "the heartbeat made " + std::to_string(beat_->beats) + " beats where " + std::to_string(expected) +
           " are due";
  return std::nullopt;
}

}  // namespace probebox::campaign
