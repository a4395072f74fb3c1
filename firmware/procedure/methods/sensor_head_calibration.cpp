#include <Eigen/Core>
#include <array>
#include <utility>
#include <vector>

#include "firmware/metrology/rotary/sensor_head.hpp"
#include "firmware/procedure/dataset/hold_readings.hpp"
#include "firmware/procedure/methods/methods.hpp"
#include "firmware/procedure/methods/needs.hpp"
#include "firmware/procedure/plan/holds.hpp"

namespace probebox::procedure {
namespace {

using Eigen::Vector3d;

constexpr std::array kNeedsOfSensorHeadCalibration{&kSensorHead};

// As parts of the range of a sensor: the middle of the ball is found by hand to within the rest.
constexpr std::array<double, 4> kMoves{0.4, 0.2, -0.2, -0.4};

// Every linear axis alone to either side of the middle, and the middle itself.
void addMoves(Plan& plan, Step step) {
  add(plan, step);
  for (std::size_t axis = 0; axis < kLinearAxes; ++axis) {
    for (const double move : kMoves) {
      std::array<double, 3> direction{};
      direction[axis] = move > 0 ? 1 : -1;
      step.touch.outward_normal = step.touch.retract_direction = direction;
      step.touch.travel_mm = (move > 0 ? move : -move) * step.touch.head_range_mm;
      step.touch.reading = static_cast<std::uint32_t>(plan.step_count);
      add(plan, step);
    }
  }
}

constexpr OwnSteps kMovesAroundTheMiddle{.why_refused = whyNoHolds,
                                         .fill = [](Plan& plan, const ProcedureOptions& options) {
                                           addMoves(plan, holdAt({}, Feature::datum_sphere, options));
                                         }};

// The machine moves the head, so the ball goes the other way.
void addMoves(metrology::Dataset& dataset, const std::vector<Hold>& holds) {
  Vector3d reference = Vector3d::Zero();
  for (const auto& hold : holds) reference += hold.at_mm / static_cast<double>(holds.size());
  auto moves = metrology::emptyTable(metrology::kSensorHeadCalibration, "moves");
  for (const auto& hold : holds) {
    const Vector3d u = reference - hold.at_mm;
    moves.append({u.x(), u.y(), u.z(), hold.sensors[0], hold.sensors[1], hold.sensors[2]});
  }
  if (!holds.empty()) dataset.config["tool"] = static_cast<double>(holds.front().request->tool);
  dataset.config["reference_mm"] = std::vector<double>{reference.begin(), reference.end()};
  dataset.tables.insert(dataset.tables.begin(), std::move(moves));
}

}  // namespace

constinit const LiveMethod kSensorHeadCalibration{
    .number = 22,
    .solver = &metrology::kSensorHeadCalibration,
    .why_no_y = "moves a sensor head along X, Y and Z, and this machine has no Y.",
    .steps =
        "13 holds of the sensor head over the datum sphere: in its middle, and 0.2 and 0.4 of `range_mm` to either "
        "side of it along X, Y and Z; A, B and C at 0",
    .needs = kNeedsOfSensorHeadCalibration,
    .kind = Kind::hold,
    .own_steps = &kMovesAroundTheMiddle,
    .dataset = [](const FinishedRun& run) {
      auto [built, holds] = holdDataset(run);
      addMoves(built.dataset, holds);
      return std::move(built);
    }};

}  // namespace probebox::procedure
