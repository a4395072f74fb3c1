#pragma once
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "firmware/metrology/dataset/dataset.hpp"
#include "firmware/metrology/dataset/result.hpp"
#include "firmware/procedure/dataset/ball_reading.hpp"
#include "firmware/procedure/facts/facts.hpp"

// Touches with the shank of the stylus, used together with readings of its tip by the methods with several lengths.
namespace probebox::procedure {

// Corrects touches beside the centre line of their side: ball and shank are round, so they touch closer to the ball's
// centre there. The other touches of the reading give the centre line. Refuses: no-shank (not described),
// shank-radius-wrong (another part than the shank touched).
std::optional<metrology::Refusal> centreTouches(std::vector<ShankReading>& touches,
                                                const std::vector<Reading>& readings, const Facts& facts);

// Table shank of a-axis-alignment, one row per touch, and sigma_shank_mm.
void addShankOfAlignment(metrology::Dataset& dataset, const std::vector<ShankReading>& touches, const Facts& facts);
// Table shank of swivel-error: each row is the mean of the touches from one side at one angle of B, as a control with
// nominal kinematics reports them, averaged over half a turn of A. The length of the shank is added to table queries.
void addShankOfSwivel(metrology::Dataset& dataset, const std::vector<ShankReading>& touches, const Facts& facts);

}  // namespace probebox::procedure
