#include "firmware/metrology/joint/joint.hpp"

#include "firmware/procedure/dataset/shift_touches.hpp"
#include "firmware/procedure/methods/methods.hpp"

namespace probebox::procedure {
namespace {

constexpr std::size_t kAnglesOfTurn = 4;

constexpr Poses kTurnAfterTurn{
    .count = [](const ProcedureOptions& options, const LoopState&) { return std::size_t{options.angles}; },
    .at =
        [](const ProcedureOptions&, const LoopState&, std::size_t index) {
          const auto quarter = static_cast<double>(index % kAnglesOfTurn);
          return Pose{{0, 0, kTurn_rad / kAnglesOfTurn * quarter}, 1};
        }};

// The gain of a screw rests on where its nut stands.
std::optional<Error> whyNotReferenced(const ProcedureOptions&, const MachineNow& now, const Facts&) {
  for (std::size_t axis = 0; axis < now.size(); ++axis) {
    if (now[axis].referenced) continue;
    return Error{std::string{"The gain of a screw follows from machine positions, and the axis "} + "XYZ"[axis] +
                 " is not referenced: home it, or move it over its reference mark."};
  }
  return std::nullopt;
}

}  // namespace

constinit const LiveMethod kJoint{
    .number = 36,
    .solver = &metrology::kJoint,
    .why_no_trigger =
        "finds the delay with the turning axis, and a touch-trigger probe has none: centreline reads the axis with it.",
    .why_no_y =
        "finds X and Y of the turning axis, and no touch of a machine without Y tells that Y: centreline-x "
        "finds X, and its slope over Z.",
    .steps =
        "one ball on the part's spindle, C at 0, 90, 180 and 270 degrees again and again, 12 angles in all "
        "(`--angles`), five touches each at 10 and 25 mm/s, while the screws warm or cool",
    .feature = Feature::part_ball,
    .sides = kSphereSides,
    .poses = kTurnAfterTurn,
    .usual = with(touchesAt(10, 25), [](auto& options) { options.angles = 12; }),
    .closes = 1,
    .why_not_now = whyNotReferenced,
    .dataset = shiftDataset};

}  // namespace probebox::procedure
