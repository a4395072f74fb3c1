#include "board/describe/places.hpp"

#include <string>
#include <utility>

namespace probebox::board {
namespace {

// An axis whose own description is wrong says nothing about others.
bool hasTravel(const AxisDescription& axis) {
  return axis.travel_min_mm < axis.travel_max_mm;
}

void requireWithin(Section& section, std::string_view key, double position_mm, std::size_t axis, const Machine& machine,
                   double margin_in_travels) {
  const auto& [min_mm, max_mm] = std::pair{machine.axes.at(axis).travel_min_mm, machine.axes.at(axis).travel_max_mm};
  const double margin_mm = margin_in_travels * (max_mm - min_mm);
  if (!hasTravel(machine.axes.at(axis))) return;
  if (position_mm >= min_mm - margin_mm && position_mm <= max_mm + margin_mm) return;
  section.problem(key, std::string{"has "} + "XYZ"[axis] + " = " + plain(position_mm) + ", and that axis travels " +
                           inWords({min_mm, max_mm}) + " mm: correct it, or the travel in [axis." + "XYZ"[axis] + "]");
}

}  // namespace

void requireReachable(Section& section, std::string_view key, double position_mm, std::size_t axis,
                      const Machine& machine) {
  if (section.good(key)) requireWithin(section, key, position_mm, axis, machine, 0);
}

void requireReachable(Section& section, std::string_view key, const std::array<double, 3>& position_mm,
                      const Machine& machine) {
  if (!section.good(key)) return;
  for (std::size_t axis = 0; axis < position_mm.size(); ++axis)
    requireWithin(section, key, position_mm.at(axis), axis, machine, 0);
}

void requireNear(Section& section, std::string_view key, double position_mm, std::size_t axis, const Machine& machine) {
  if (section.good(key)) requireWithin(section, key, position_mm, axis, machine, 1);
}

}  // namespace probebox::board
