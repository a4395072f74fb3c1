#include "tools/gcode/place_of.hpp"

#include <Eigen/Geometry>
#include <string>

namespace probebox::gcode {
namespace {

using Eigen::Vector3d;
using procedure::Feature;
using procedure::Step;

Vector3d turnedAbout(const Vector3d& point, double angle_rad, const Vector3d& axis, const Vector3d& through) {
  return through + Eigen::AngleAxisd{angle_rad, axis} * (point - through);
}

Vector3d ballOf(const Step& step, const Setting& setting) {
  const bool tilts = step.b_moves == procedure::BMoves::table;
  return ballInPose(step.touch.ball - 1U, step.touch.rotary_angles_rad, tilts, setting);
}

// Half of what touches across its axis: the stylus ball, or the tool that is measured.
double touchingRadius(const Step& step, const Setting& setting) {
  const bool tool = step.feature == Feature::tool_setter && step.touch.tool != 0;
  return (tool ? *setting.tool_diameter_mm : *setting.stylus_diameter_mm) / 2;
}

Place aroundSetter(const Step& step, const Setting& setting) {
  const double half = *setting.setter_width_mm / 2, around = touchingRadius(step, setting);
  const Vector3d half_mm{half + around, half + around, half + (step.touch.tool != 0 ? 0 : around)};
  return {Place::Shape::block, setting.at_mm, half_mm.norm() + setting.keep_off_mm, half_mm};
}

Error missing(const char* what, const char* option) {
  return Error{std::string{"The program has to know "} + what + ": give " + option + "."};
}

}  // namespace

Vector3d ballInPose(std::size_t ball, const std::array<double, 3>& angles_rad, bool tilts, const Setting& setting) {
  const Vector3d turned = turnedAbout(setting.balls_mm[ball], angles_rad[2], Vector3d::UnitZ(), setting.c_axis_mm);
  return tilts ? turnedAbout(turned, angles_rad[1], setting.b_axis, *setting.table_axis_mm) : turned;
}

bool movesOneAxis(const Step& step) {
  return step.kind == procedure::Kind::jog || step.kind == procedure::Kind::sweep;
}

std::optional<Error> whyUnknown(const Step& step, const Setting& setting) {
  if (!setting.safe_z_mm) return missing("a height above everything", "--safe-z MM, in the work offset");
  if (movesOneAxis(step) || step.kind == procedure::Kind::rest) return std::nullopt;
  if (step.touch.shank_height_mm > 0)
    return Error{
        "A run by the shank has its heights from machine.toml: let the control read its steps from the box "
        "(docs/integrator.md)."};
  if (step.b_moves == procedure::BMoves::head && step.touch.tool == 0 && setting.probe_tool == 0)
    return missing("whose length keeps the tip in place while the head swivels",
                   "--probe-tools NUMBER, the tool that carries the probe");
  const bool by_tool = step.feature == Feature::tool_setter && step.touch.tool != 0;
  if (!by_tool && !setting.stylus_diameter_mm) return missing("the stylus ball", "--stylus MM, its diameter");
  if (by_tool && !setting.tool_diameter_mm) return missing("the tool's width", "--tool-diameter MM");
  switch (step.feature) {
    case Feature::plates:
      return setting.gap_mm ? std::nullopt : std::optional{missing("the gap", "--gap MM")};
    case Feature::tool_setter:
      return setting.setter_width_mm ? std::nullopt : std::optional{missing("the setter's width", "--setter MM")};
    case Feature::part_ball:
      if (step.touch.ball == 0 || step.touch.ball > setting.balls_mm.size()) {
        const std::string number = std::to_string(step.touch.ball);
        return Error{"The program has to know where ball " + number + " of the part is at C = 0: give --ball X,Y,Z, " +
                     number + " of them."};
      }
      if (step.b_moves == procedure::BMoves::table && !setting.table_axis_mm)
        return missing("the axis of the tilting table", "--table-axis X,Y,Z, a point of it");
      break;
    case Feature::datum_sphere:
      break;
  }
  return setting.ball_diameter_mm ? std::nullopt : std::optional{missing("the ball", "--sphere MM, its diameter")};
}

Place placeOf(const Step& step, const Setting& setting) {
  if (step.feature == Feature::tool_setter) return aroundSetter(step, setting);
  if (step.feature == Feature::plates) {
    const double half = (*setting.gap_mm - *setting.stylus_diameter_mm) / 2;
    return {Place::Shape::gap, setting.at_mm, 0, Vector3d::Constant(half)};
  }
  const Vector3d centre = step.feature == Feature::part_ball ? ballOf(step, setting) : setting.at_mm;
  // A sensor head comes over its ball from above.
  if (step.kind == procedure::Kind::hold) return {Place::Shape::gap, centre, 0, Vector3d::Zero()};
  const double met_mm = (*setting.ball_diameter_mm + *setting.stylus_diameter_mm) / 2;
  return {Place::Shape::round, centre, met_mm + setting.keep_off_mm, Vector3d::Constant(met_mm)};
}

Vector3d surfaceOf(const Step& step, const Place& place, const Setting& setting) {
  const Vector3d normal = vectorOf(step.touch.outward_normal);
  if (step.kind == procedure::Kind::hold) return place.centre_mm + step.touch.travel_mm * normal;
  if (place.shape == Place::Shape::gap) return place.centre_mm - place.half_mm.x() * normal;
  if (place.shape == Place::Shape::block) return place.centre_mm + place.half_mm.cwiseProduct(normal);
  return place.centre_mm + (place.keep_out_mm - setting.keep_off_mm) * normal;
}

}  // namespace probebox::gcode
