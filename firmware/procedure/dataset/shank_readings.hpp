#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/facts/facts.hpp"

// Touches with the shank of the stylus, as the methods with several lengths take them beside readings with its tip.
namespace probebox::procedure {

// Takes out what the roundness of ball and shank makes of touches beside the middle of their side: there they meet
// nearer to the ball's centre. Where the middle is, the other touches of the same reading tell. Refuses: no-shank (none
// is described), shank-radius-wrong (touches show another radius: something else than the shank touched).
std::optional<metrology::Refusal> centreTouches(std::vector<ShankReading>& touches,
                                                const std::vector<Reading>& readings, const Facts& facts);

// Table shank of a-axis-alignment, a row a touch, and sigma_shank_mm. angle_mm: what a stop of C moves the ball by
// (k = 1); the touches of one pose share it.
void addShankOfAlignment(metrology::Dataset& dataset, const std::vector<ShankReading>& touches, const Facts& facts,
                         double angle_mm);
// The same of swivel-error: a row is the mean of the touches from one side at one stop of B, as the control with the
// nominal kinematics reports them, half a turn of A between them. Table queries gets the length of the shank too.
void addShankOfSwivel(metrology::Dataset& dataset, const std::vector<ShankReading>& touches, const Facts& facts);

}  // namespace probebox::procedure
