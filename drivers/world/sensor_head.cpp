#include "drivers/world/sensor_head.hpp"

#include <algorithm>
#include <cmath>
#include <span>

namespace probebox::world {

void SensorHead::stand(const HeadStand& stand) {
  stands_[count_++ % kRemembered] = stand;
}

const HeadStand* SensorHead::standAt(MonoTime at) const {
  const HeadStand* oldest = nullptr;
  for (std::uint64_t i = count_; i > 0 && count_ - i < kRemembered; --i) {
    oldest = &stands_[(i - 1) % kRemembered];
    if (oldest->since <= at) break;
  }
  return oldest;
}

std::optional<HeadReading> SensorHead::reading(const Vector3& body, MonoTime at, double delay_s) const {
  const HeadStand* stand = standAt(at - Nanoseconds{std::llround(1e9 * delay_s)});
  if (stand == nullptr || !stand->head) return std::nullopt;
  const Vector3 centre = body + stand->centre;
  const auto balls = std::span{stand->balls.centres}.first(stand->balls.count);
  const auto& ball = *std::ranges::min_element(balls, {}, [&](const Vector3& b) { return norm(b - centre); });
  const Vector3 in_head = transposed(stand->turned) * (ball - centre);
  return HeadReading{stand->head->sensors * in_head, stand->head->range_mm, stand->head->noise_um};
}

}  // namespace probebox::world
