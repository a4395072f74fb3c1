#include "firmware/metrology/centreline/standing_axes.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "protocol/units/angle.hpp"
#include "protocol/units/tolerances.hpp"

namespace probebox::metrology {
namespace {

bool apart(double angle_rad, double most_rad) {
  return std::abs(std::remainder(angle_rad, kTurn)) > most_rad;
}

// The same stop for all rows, whole turns aside.
bool stoodStill(const Table& table, std::string_view column) {
  const auto* angles = table.column(column);
  if (angles == nullptr || angles->empty()) return false;
  return std::ranges::none_of(*angles, [&](double angle) { return apart(angle - angles->front(), kSameStop_rad); });
}

// Spindle and C turned by the same angles.
bool turnedTogether(const Table& table) {
  const auto* spindle = table.column(column::kA);
  const auto* c = table.column(column::kC);
  if (spindle == nullptr || c == nullptr || spindle->size() != c->size()) return false;
  for (std::size_t k = 0; k < c->size(); ++k) {
    if (apart(((*spindle)[k] - (*c)[k]) - (spindle->front() - c->front()), 2 * kSameStop_rad)) return false;
  }
  return true;
}

}  // namespace

bool spindleStoodStill(const Dataset& dataset) {
  const Table* table = dataset.table("readings");
  return table != nullptr && stoodStill(*table, column::kA);
}

std::optional<std::string> undeterminedByAngles(const Dataset& dataset) {
  const Table* table = dataset.table("readings");
  if (table == nullptr) return std::nullopt;
  if (stoodStill(*table, column::kA)) {
    return "the spindle axis: the spindle stood still, so its axis cannot be separated from the tip";
  }
  if (stoodStill(*table, column::kC)) return "the C axis: C stood still, so its axis cannot be separated from the ball";
  if (turnedTogether(*table)) {
    return "offsets of ball and stylus separately: spindle and C turned together, so only ball minus stylus";
  }
  return std::nullopt;
}

}  // namespace probebox::metrology
