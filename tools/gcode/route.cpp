#include "tools/gcode/route.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

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

}  // namespace probebox::gcode
