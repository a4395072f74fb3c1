#include "board/describe/world_axes_sections.hpp"

#include <string>

#include "protocol/units/angle.hpp"

namespace probebox::board {
namespace {

constexpr Range kSmall_um{0, 1000};

WorldWave readWave(Section& section) {
  return {.amplitude_mm = 1e-3 * section.number("wave_um", kSmall_um, 0.0),
          .length_mm = section.number("wave_length_mm", {1, 10'000}, 100.0),
          .phase_rad = kDegree * section.number("wave_phase_deg", {-360, 360}, 0.0)};
}

}  // namespace

void readLinearAxes(Section& root, World& world) {
  auto section = root.sectionIfThere("linear_axes");
  if (!section) return;
  auto& axes = world.linear_axes;
  for (std::size_t i = 0; i < 3; ++i)
    axes.squareness_rad.at(i) =
        section->number(std::array{"EA0Z_rad", "EB0Z_rad", "EC0Y_rad"}.at(i), {-0.01, 0.01}, 0.0);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    for (std::size_t along = 0; along < 3; ++along) {
      auto error = section->sectionIfThere(std::string{"E"} + "XYZ"[along] + "XYZ"[axis]);
      if (!error) continue;
      // Straightness has no slope: that is squareness.
      if (along == axis) axes.scale.at(axis) = 1e-6 * error->number("scale_um_m", {-10'000, 10'000}, 0.0);
      axes.waves.at(axis).at(along) = readWave(*error);
      error->finish();
    }
  }
  section->finish();
}

void readTouchTrigger(Section& root, World& world) {
  auto section = root.sectionIfThere("touch_trigger");
  if (!section) return;
  world.touch_trigger =
      WorldTouchTrigger{.pre_travel_mm = section->number("pre_travel_mm", {0, 1}),
                        .lobe_mm = section->number("lobe_mm", {0, 1}, 0.0),
                        .axial_mm = section->number("axial_mm", {0, 1}, 0.0),
                        .hysteresis_mm = section->number("hysteresis_mm", {0, 1}, 0.0),
                        .repeatability_um = section->number("repeatability_um", kSmall_um, 0.0),
                        .late_s = section->number("late_s", {0, 0.5}, 0.0),
                        .chatter_probability = section->number("chatter_probability", kProbability, 0.0),
                        .chatter_s = section->number("chatter_s", {0, 0.1}, 0.0008)};
  section->finish();
}

WorldMount readWorldMount(Section& section) {
  WorldMount mount{.turn_rad = section.vectorIfThere("turn_deg", {-180, 180}).value_or(Vector3{}),
                   .shift_mm = section.vectorIfThere("shift_mm", {-1000, 1000}).value_or(Vector3{})};
  for (double& angle : mount.turn_rad) angle *= kDegree;
  section.finish();
  return mount;
}

WorldAxisErrors readAxisErrors(Section& section) {
  const auto error = [&](std::string_view key, double most) {
    return section.vectorIfThere(key, {-most, most}).value_or(Vector3{});
  };
  return {.cosine_mm = error("error_cosine_mm", 1),
          .sine_mm = error("error_sine_mm", 1),
          .cosine_rad = error("error_cosine_rad", 0.01),
          .sine_rad = error("error_sine_rad", 0.01)};
}

}  // namespace probebox::board
