#pragma once
#include <array>
#include <cstddef>

#include "drivers/world/vector.hpp"

namespace probebox::world {

// Plans straight moves between two points outside a sphere that keep their distance from it.
class SafePath {
 public:
  // Start and target may be nearer to the sphere than `keep_out_mm`: they are left and reached along their radius.
  // Opposite sides are joined over the top (+Z), where no stem holds the sphere.
  SafePath() = default;
  SafePath(const Vector3& start, const Vector3& target, const Vector3& centre, double keep_out_mm);

  bool done() const { return next_ == count_; }
  // Only while not done.
  const Vector3& next() const { return points_[next_]; }
  void pass() { ++next_; }
  std::size_t size() const { return count_; }

 private:
  void add(const Vector3& point) { points_[count_++] = point; }
  void addArc(const Vector3& from, const Vector3& to, const Vector3& centre, double shell_mm);

  static constexpr std::size_t kMostPoints = 12;
  std::array<Vector3, kMostPoints> points_{};
  std::size_t count_{};
  std::size_t next_{};
};

// Describes a feature that the stylus has to avoid or approach, as the controller's program knows it.
struct Place {
  enum class Shape { round, gap, block, beside };  // beside: a round one that the shank touches, the tip below it
  Shape shape{Shape::round};
  Vector3 centre{};
  double keep_out_mm{};   // of a round feature or a block: traverses stay this far from its centre
  Vector3 half_mm{};      // of a block or a gap, from its centre to where its faces are met
  Vector3 entrance_mm{};  // of a gap that is covered from above: from its centre to where the way down is free

  friend bool operator==(const Place&, const Place&) = default;
};

// Plans traverses between features: up to a height that is free everywhere, across, and down.
class Route {
 public:
  Route() = default;
  // Plans a way near one place, around which the tip moves.
  static Route within(const Place& place, const Vector3& from, const Vector3& to);
  static Route up(const Place& place, const Vector3& from, double height_mm);
  // Plans the way down. Beside a feature it is vertical, because the shank above the tip has to pass too.
  static Route down(const Place& place, const Vector3& from, const Vector3& to);

  bool done() const { return next_ == count_; }
  // Only while not done.
  const Vector3& next() const { return points_[next_]; }
  void pass() { ++next_; }
  void add(const Vector3& point) { points_[count_++] = point; }

 private:
  void add(SafePath path);

  static constexpr std::size_t kMostPoints = 16;
  std::array<Vector3, kMostPoints> points_{};
  std::size_t count_{};
  std::size_t next_{};
};

}  // namespace probebox::world
