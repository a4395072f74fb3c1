#include "tools/interference/motion.hpp"

#include <algorithm>
#include <cmath>

namespace probebox::interference {
namespace {

// An arc in its plane, from the middle.
struct Polar {
  double from_mm, to_mm, from_rad;
};

Polar polarOf(const Move& move, std::size_t first, std::size_t second) {
  const double dx = move.from[first] - move.middle[0], dy = move.from[second] - move.middle[1];
  return {std::hypot(dx, dy), std::hypot(move.to[first] - move.middle[0], move.to[second] - move.middle[1]),
          std::atan2(dy, dx)};
}

}  // namespace

Point placeOn(const Move& move, double part) {
  if (part <= 0) return move.from;
  if (part >= 1) return move.to;
  Point at{};
  for (std::size_t k = 0; k < at.size(); ++k) at[k] = move.from[k] + part * (move.to[k] - move.from[k]);
  if (move.turn_rad == 0) return at;
  const std::size_t first = (move.normal + 1u) % 3, second = (move.normal + 2u) % 3;
  const auto polar = polarOf(move, first, second);
  const double radius = polar.from_mm + part * (polar.to_mm - polar.from_mm);
  const double angle = polar.from_rad + part * move.turn_rad;
  at[first] = move.middle[0] + radius * std::cos(angle);
  at[second] = move.middle[1] + radius * std::sin(angle);
  return at;
}

double lengthOf(const Move& move) {
  const double x = move.to[0] - move.from[0], y = move.to[1] - move.from[1], z = move.to[2] - move.from[2];
  if (move.turn_rad == 0) return std::hypot(x, y, z);
  const auto polar = polarOf(move, (move.normal + 1u) % 3, (move.normal + 2u) % 3);
  const double along = move.to[move.normal] - move.from[move.normal];
  return std::hypot(std::max(polar.from_mm, polar.to_mm) * move.turn_rad, along, polar.to_mm - polar.from_mm);
}

std::vector<Move> dogLeg(const Move& move) {
  std::vector<double> distances;
  for (std::size_t k = 0; k < move.to.size(); ++k) {
    if (move.to[k] != move.from[k]) distances.push_back(std::abs(move.to[k] - move.from[k]));
  }
  std::ranges::sort(distances);
  const auto [begin, end] = std::ranges::unique(distances);
  distances.erase(begin, end);
  if (distances.size() < 2) return {};
  std::vector<Move> legs;
  for (const double gone : distances) {
    Move leg = legs.empty() ? move : legs.back();
    if (!legs.empty()) leg.from = leg.to, leg.from_deg = leg.to_deg;
    for (std::size_t k = 0; k < leg.to.size(); ++k) {
      const double whole = move.to[k] - move.from[k];
      leg.to[k] = std::abs(whole) <= gone ? move.to[k] : move.from[k] + std::copysign(gone, whole);
      const double turned = gone / distances.back();
      leg.to_deg[k] = move.from_deg[k] + turned * (move.to_deg[k] - move.from_deg[k]);
    }
    legs.push_back(leg);
  }
  return legs;
}

}  // namespace probebox::interference
