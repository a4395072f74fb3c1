#include "drivers/world/following.hpp"

#include <algorithm>
#include <array>
#include <cstdio>

namespace probebox::world {
namespace {

constexpr double kMostSpeed_mm_s = 2000;

std::string inWords(const Vector3& mm) {
  std::array<char, 96> text{};
  std::snprintf(text.data(), text.size(), "%.3f %.3f %.3f", mm[0], mm[1], mm[2]);
  return text.data();
}

}  // namespace

std::optional<std::string> Following::take(const Lead& lead, MonoTime now) {
  const Vector3 here_mm = last_ ? last_->motor_mm : world_.machine().commandedPosition();
  if (norm(lead.motor_mm - here_mm) > kMostSpeed_mm_s * toSeconds(config_.cycle))
    return "the motors jump to " + inWords(lead.motor_mm) + " mm: begin where they stand, at " + inWords(here_mm) +
           " mm";
  if (!world_.machine().hasTool(lead.tool))
    return "there is no tool " + std::to_string(lead.tool) + ": name one of world.toml";
  if (!world_.machine().hasMount(lead.mount))
    return "there is no mount " + std::to_string(lead.mount) + " of the balls: name one of world.toml";
  const MonoTime from = std::max(until_, world_.now()), until = from + config_.cycle;
  const bool rests = !last_ || lead == *last_;
  world_.follow(lead, from, until);
  until_ = rests ? std::max(from, now + config_.late) : until;
  last_ = lead;
  told_ = now;
  return std::nullopt;
}

MonoTime Following::known(MonoTime now) const {
  const bool led = last_ && now - told_ < config_.patience;
  return led ? std::min(now, until_) : now;
}

}  // namespace probebox::world
