#include "tools/gcode/place_of.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

namespace probebox::gcode {
namespace {

using Eigen::Vector3d;

constexpr double kLongestStep_rad = std::numbers::pi / 3;
constexpr double kOverTheTopFrom_rad = 1.75;  // a little more than a right angle
constexpr double kSame_mm = 1e-9;

Vector3d directionOf(const Vector3d& point, const Vector3d& centre) {
  const Vector3d way = point - centre;
  return way.norm() < kSame_mm ? Vector3d{Vector3d::UnitZ()} : Vector3d{way.normalized()};
}

double angleBetween(const Vector3d& a, const Vector3d& b) {
  return std::atan2(a.cross(b).norm(), a.dot(b));
}

// Chords of a sphere, none nearer to its centre than keep_out.
double shellOf(const Place& place) {
  return 1.01 * place.keep_out_mm / std::cos(kLongestStep_rad / 2);
}

void addArc(Blocks& blocks, const Place& place, const Vector3d& from, const Vector3d& to, double feed_mm_min) {
  const double angle = angleBetween(from, to);
  if (angle < 1e-9) return;
  Vector3d aside = to - from.dot(to) * from;
  if (std::sin(angle) < 1e-6) aside = from.unitOrthogonal();  // straight through the centre: any side will do
  aside.normalize();
  const int steps = static_cast<int>(std::ceil(angle / kLongestStep_rad - 1e-9));
  for (int i = 1; i <= steps; ++i) {
    const double turned = angle * i / steps;
    const Vector3d point = place.centre_mm + shellOf(place) * (std::cos(turned) * from + std::sin(turned) * aside);
    blocks.push_back(Move{point, feed_mm_min, Way::traverse});
  }
}

// Straight up from there would lead too near to the centre, or through it.
bool isBelow(const Place& place, const Vector3d& from) {
  const Vector3d way = from - place.centre_mm;
  return place.shape != Place::Shape::gap && way.z() < -kSame_mm && way.head<2>().norm() < shellOf(place);
}

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

Place whereItIs(const Step& step, const Setting& setting) {
  if (step.feature == Feature::tool_setter) return aroundSetter(step, setting);
  if (step.feature == Feature::plates || step.feature == Feature::cylinder) {
    const double size_mm = step.feature == Feature::plates ? *setting.gap_mm : *setting.bore_mm;
    const double half = (size_mm - *setting.stylus_diameter_mm) / 2;
    return {Place::Shape::gap, setting.at_mm, 0, Vector3d::Constant(half)};
  }
  if (step.feature == Feature::cube) {
    const Vector3d half = (setting.cube_mm->array() + *setting.stylus_diameter_mm) / 2;
    return {Place::Shape::block, setting.at_mm, half.norm() + setting.keep_off_mm, half};
  }
  const Vector3d centre = step.feature == Feature::part_ball ? ballOf(step, setting) : setting.at_mm;
  // A sensor head comes over its ball from above.
  if (step.kind == procedure::Kind::hold) return {Place::Shape::gap, centre, 0, Vector3d::Zero()};
  const double met_mm = (*setting.ball_diameter_mm + *setting.stylus_diameter_mm) / 2;
  return {Place::Shape::round, centre, met_mm + setting.keep_off_mm, Vector3d::Constant(met_mm)};
}

Error missing(const char* what, const char* option) {
  return Error{std::string{"The program has to know "} + what + ": give " + option + "."};
}

}  // namespace

void goRound(Blocks& blocks, const Place& place, const Vector3d& from, const Vector3d& to, const Feeds& feeds) {
  if ((from - to).norm() < kSame_mm) return;
  if (place.shape == Place::Shape::gap) {
    blocks.push_back(Move{to, feeds.near_mm_min, Way::near});
    return;
  }
  const Vector3d first = directionOf(from, place.centre_mm), last = directionOf(to, place.centre_mm);
  const bool inside = (from - place.centre_mm).norm() < place.keep_out_mm;
  blocks.push_back(Move{place.centre_mm + shellOf(place) * first, inside ? feeds.near_mm_min : feeds.traverse_mm_min,
                        inside ? Way::near : Way::traverse});
  if (angleBetween(first, last) > kOverTheTopFrom_rad) {
    addArc(blocks, place, first, Vector3d::UnitZ(), feeds.traverse_mm_min);
    addArc(blocks, place, Vector3d::UnitZ(), last, feeds.traverse_mm_min);
  } else {
    addArc(blocks, place, first, last, feeds.traverse_mm_min);
  }
  blocks.push_back(Move{to, feeds.near_mm_min, Way::near});
}

void goUp(Blocks& blocks, const Place& place, const Vector3d& from, double safe_z_mm, const Feeds& feeds) {
  Vector3d aside = from;
  const Vector3d direction = directionOf(from, place.centre_mm);
  const bool below = isBelow(place, from);
  if (place.shape == Place::Shape::gap) {
    aside = place.centre_mm;
  } else if (below || (from - place.centre_mm).norm() < place.keep_out_mm) {
    aside = place.centre_mm + shellOf(place) * direction;
  }
  if ((aside - from).norm() > kSame_mm) blocks.push_back(Move{aside, feeds.near_mm_min, Way::near});
  if (below) {
    const Vector3d aside_of_it{direction.x(), direction.y(), 0};
    const Vector3d level = aside_of_it.norm() < kSame_mm ? Vector3d{Vector3d::UnitX()} : aside_of_it.normalized();
    addArc(blocks, place, direction, level, feeds.traverse_mm_min);
    aside = place.centre_mm + shellOf(place) * level;
  }
  blocks.push_back(Move{{aside.x(), aside.y(), safe_z_mm}, feeds.traverse_mm_min, Way::level});
}

void goDown(Blocks& blocks, const Place& place, const Vector3d& to, double safe_z_mm, const Feeds& feeds) {
  const Vector3d above{place.centre_mm.x(), place.centre_mm.y(), safe_z_mm};
  blocks.push_back(Move{above, feeds.traverse_mm_min, Way::level});
  if (place.shape == Place::Shape::gap) {
    blocks.push_back(Move{place.centre_mm, feeds.near_mm_min, Way::near});
    goRound(blocks, place, place.centre_mm, to, feeds);
    return;
  }
  const Vector3d top = place.centre_mm + shellOf(place) * Vector3d::UnitZ();
  blocks.push_back(Move{top, feeds.traverse_mm_min, Way::traverse});
  goRound(blocks, place, top, to, feeds);
}

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
      if (step.touch.outward_normal[2] != 0)
        return Error{
            "Plates across Z are reached from the side, below the upper one, where a program does not know what is in "
            "the way: let the control read its steps from the box (docs/integrator.md)."};
      return setting.gap_mm ? std::nullopt : std::optional{missing("the gap", "--gap MM")};
    case Feature::cylinder:
      return setting.bore_mm ? std::nullopt
                             : std::optional{missing("the bore",
                                                     "--bore MM; a pin, whose height it does not know, is "
                                                     "touched from the steps of the box")};
    case Feature::cube:
      return setting.cube_mm ? std::nullopt : std::optional{missing("the cube", "--cube X,Y,Z, its edges")};
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
    case Feature::second_part_ball:
      return Error{
          "A program does not know where the second chuck is: let the control read its steps from the box "
          "(docs/integrator.md)."};
    case Feature::datum_sphere:
      break;
  }
  return setting.ball_diameter_mm ? std::nullopt : std::optional{missing("the ball", "--sphere MM, its diameter")};
}

Place placeOf(const Step& step, const Setting& setting) {
  Place place = whereItIs(step, setting);
  if (!setting.has_y) place.centre_mm.y() = 0;
  return place;
}

Vector3d surfaceOf(const Step& step, const Place& place, const Setting& setting) {
  const Vector3d normal = vectorOf(step.touch.outward_normal);
  if (step.kind == procedure::Kind::hold) return place.centre_mm + step.touch.travel_mm * normal;
  if (place.shape == Place::Shape::gap) return place.centre_mm - place.half_mm.x() * normal;
  if (place.shape == Place::Shape::block) return place.centre_mm + place.half_mm.cwiseProduct(normal);
  return place.centre_mm + (place.keep_out_mm - setting.keep_off_mm) * normal;
}

}  // namespace probebox::gcode
