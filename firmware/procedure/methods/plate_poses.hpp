#pragma once
#include <cstdint>
#include <optional>

#include "firmware/capture/recording.hpp"
#include "firmware/procedure/plan/poses.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

// Where the balls of a plate are read: in every mount at all angles of the axis, and once more with the axis at zero,
// where they show the place of the plate. By stations: of the balls at an angle only those that the axis has brought to
// the places where the first balls stand at zero.
namespace probebox::procedure {

extern const Poses kOnPlate;

// Angle of the rotary axis at a step, by its number from 1; 0 with the axis at zero, once more.
constexpr capture::MethodNote noteOfStop(std::uint16_t stop) {
  return {static_cast<double>(stop)};
}
constexpr std::uint16_t stopOf(const capture::MethodNote& note) {
  return static_cast<std::uint16_t>(note[0]);
}

// Names the first of stations and mounts that makes no sense, and its valid range.
std::optional<Error> whyNoPlate(const ProcedureOptions& with_defaults);

}  // namespace probebox::procedure
