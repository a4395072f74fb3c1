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

}  // namespace probebox::world
