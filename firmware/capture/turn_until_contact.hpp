#pragma once
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "firmware/capture/recording.hpp"

// Steps in which C turns until the ball on the rim touches the stylus, which stands still.
namespace probebox::capture {

// Deflection that is a contact, and no noise or vibration.
inline constexpr double kTouched_mm = 0.03;

// Angle of C at that stamp, interpolated; nullopt outside of the rows.
std::optional<double> angleAt(std::span<const AngleRow> rows, MonoTime at);

// What a turn lacks. Complete: the ball touched, coming from the side that was asked for, and left the stylus again,
// and the angle of C is known at both.
enum class TurnLacks : std::uint8_t { nothing, contact, release, angles, side };
TurnLacks lackOf(const Recording& recording, const Touch& touch);

// Deflection in units of the channels, against the mean at the start; rows in order.
double deflectionOf(std::span<const ProbeRow> rows, std::size_t row);

}  // namespace probebox::capture
