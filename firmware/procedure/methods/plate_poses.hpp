#pragma once
#include <cstdint>
#include <optional>

#include "firmware/capture/recording.hpp"
#include "firmware/procedure/plan/poses.hpp"
#include "protocol/events/event.hpp"
#include "protocol/units/outcome.hpp"

// Poses at which the balls of a plate are read: in every mount at all angles of the axis, and once more with the axis
// at zero, to find the place of the plate. With stations, only the balls that the axis has brought to the places that
// the first balls have at zero.
namespace probebox::procedure {

extern const Poses kOnPlate;

// Note of a step: number of the angle of the rotary axis, from 1; 0 for the last readings with the axis at zero.
constexpr capture::MethodNote noteOfStop(std::uint16_t stop) {
  return {static_cast<double>(stop)};
}
constexpr std::uint16_t stopOf(const capture::MethodNote& note) {
  return static_cast<std::uint16_t>(note[0]);
}

// Names an invalid number of stations or mounts, and its valid range.
std::optional<Error> whyNoPlate(const ProcedureOptions& with_defaults);

}  // namespace probebox::procedure
