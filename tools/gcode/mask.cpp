#include "tools/gcode/mask.hpp"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string>

#include "tools/gcode/points_of.hpp"

namespace probebox::gcode {
namespace {

double lengthOf(const Move& move, Eigen::Vector3d from_mm) {
  double length_mm = 0;
  for (const auto& point : pointsOf(move, from_mm)) {
    length_mm += (point - from_mm).norm();
    from_mm = point;
  }
  return length_mm;
}

double longestMasked_s(const Blocks& blocks) {
  double longest_s = 0, masked_s = 0;
  bool masked = false;
  Eigen::Vector3d here = Eigen::Vector3d::Zero();
  for (const auto& block : blocks) {
    if (const auto* contact = std::get_if<Contact>(&block)) {
      masked = contact->begin;
      masked_s = 0;
    } else if (const auto* wait = std::get_if<Wait>(&block)) {
      masked_s += wait->s;
    } else if (const auto* move = std::get_if<Move>(&block)) {
      masked_s += 60 * lengthOf(*move, here) / move->feed_mm_min;
      if (knowsPlace(*move)) here = move->to_mm;
    }
    if (masked) longest_s = std::max(longest_s, masked_s);
  }
  return longest_s;
}

std::string seconds(double s) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f s", s);
  return text.data();
}

}  // namespace

std::optional<Error> whyMaskedTooLong(const Blocks& blocks, const Setting& setting, const Dialect& dialect) {
  const auto most_s = dialect.mask_s();
  const double longest_s = longestMasked_s(blocks);
  if (!setting.guard || !most_s || longest_s <= *most_s) return std::nullopt;
  return Error{"A step presses the probe into the surface for " + seconds(longest_s) + " without an exact stop, and " +
               std::string{dialect.control()} + " masks it for " + seconds(*most_s) +
               " at most: choose a greater --speed, or --no-skip where the probe is not wired to the control."};
}

}  // namespace probebox::gcode
