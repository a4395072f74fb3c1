#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/capture/recording.hpp"

// Steps in which C turns until the ball on the rim touches the stylus, which stands still.
namespace probebox::capture {

// Angle of C at that stamp, interpolated; nullopt outside of the rows.
std::optional<double> angleAt(std::span<const AngleRow> rows, MonoTime at);

// Returns what is missing from the recording of a turn. In a complete one the ball touched the stylus from the
// requested side and left it again, and the angle of C is known at both.
enum class TurnLacks : std::uint8_t { nothing, contact, release, angles, side };
TurnLacks lackOf(const Recording& recording, const Touch& touch);

// Means of the channels, mm, over the first rows: the controller waits after its marker, so C does not turn yet.
std::array<double, 3> restOf(std::span<const ProbeRow> rows);
// Deflection of the stylus relative to rest_mm, mm.
std::array<double, 3> deflectionFrom(const std::array<double, 3>& rest_mm, const ProbeRow& row);
bool touches(const std::array<double, 3>& deflection_mm);

}  // namespace probebox::capture
